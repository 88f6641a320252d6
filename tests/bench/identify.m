% Reads the recording of flexspline_identify_bench and identifies the same model with GNU Octave alone. Argument: the bench's
% folder. Writes answer.txt: ms to read, ms to identify, peak bytes of each, a sum over the positions, parameters.
1;

function bytes = peak()
  status = fileread("/proc/self/status");
  bytes = 1024 * str2double(regexp(status, 'VmHWM:\s*(\d+)', "tokens"){1}{1});
end

% Butterworth of order five in sections, by the bilinear transform: rows b0 b1 b2 a0 a1 a2.
function sos = butterworth5(cutoff_hz, sample_hz)
  K = tan(pi * cutoff_hz / sample_hz);
  sos = [];
  for k = 1:2
    s = 2 * cos(pi * k / 5);
    a0 = 1 + s * K + K^2;
    sos(k, :) = [K^2 * [1 2 1] / a0, 1, 2 * (K^2 - 1) / a0, (1 - s * K + K^2) / a0];
  end
  sos(3, :) = [K * [1 1 0] / (K + 1), 1, (K - 1) / (K + 1), 0];
end

% Forward and backward, with odd reflection, each section from its steady state.
function x = filtered(sos, padding, x)
  n = rows(x);
  x = [2 * x(1, :) - x(padding + 1:-1:2, :); x; 2 * x(n, :) - x(n - 1:-1:n - padding, :)];
  for direction = 1:2
    for k = 1:3
      b = sos(k, 1:3);
      a = sos(k, 4:6);
      x = filter(b, a, x, [1 - b(1); b(3) - a(3)] * x(1, :));
    end
    x = flipud(x);
  end
  x = x(padding + 1:padding + n, :);
end

function d = slope(x, sample_hz)
  n = numel(x);
  d = [-3 * x(1) + 4 * x(2) - x(3); x(3:n) - x(1:n - 2); 3 * x(n) - 4 * x(n - 1) + x(n - 2)] * (0.5 * sample_hz);
end

function found = identify(data, sos, padding, about)
  w = slope(filtered(sos, padding, data(:, 3)), about(1));
  block = filtered(sos, padding, [slope(w, about(1)), w, abs(w), tanh(w / about(4)), about(3) * data(:, 2)]);
  kept = block(about(5) + 1:about(6):about(5) + about(6) * about(7), :);
  size = norm(kept(:, 1:4), "columns");
  found = (kept(:, 1:4) ./ size) \ kept(:, 5) ./ size';
end

folder = argv(){1};
about = dlmread([folder "/about.txt"], " ")(1:8);
sos = butterworth5(about(2), about(1));
slowest = max([sqrt(sos(1:2, 6)); abs(sos(3, 5))]);
padding = ceil(log(1e-6) / log(slowest));
times = zeros(about(8), 2);
for run = 1:about(8)
  data = [];
  start = cputime();
  data = dlmread([folder "/data.csv"], ",", 3, 0);
  times(run, 1) = 1e3 * (cputime() - start);
end
read_peak = peak();
for run = 1:about(8)
  start = cputime();
  found = identify(data, sos, padding, about);
  times(run, 2) = 1e3 * (cputime() - start);
end
out = fopen([folder "/answer.txt"], "w");
fprintf(out, "%.17g ", median(times), read_peak, peak(), sum(abs(data(:, 3))), found);
fprintf(out, "\n");
fclose(out);
