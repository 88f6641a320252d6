// Reading a CSV file and identifying a model from it, compared with NumPy with SciPy and GNU Octave: the same file, the
// same recipe, one core each, and the answers compared. Processor time, not the clock's: other work on the machine does
// not count. Usage: flexspline_identify_bench PYTHON OCTAVE FOLDER     FOLDER has identify.py and identify.m
//        flexspline_identify_bench read|identify FILE       once; prints its peak of memory in bytes
#include <sys/resource.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "tests/bench/rows.hpp"

namespace flexspline {
namespace {

using estimation::Balance;

constexpr double kSampleHz = 1000.0;
constexpr double kCutoffHz = 30.0;
constexpr double kTorqueConstant = 0.0543;
constexpr double kCounts = 65536.0;
const std::vector<std::string> kEffects = {"inertia", "viscous_friction", "viscous_asymmetry", "coulomb_friction"};

// A drive that turns as stated and the current that this takes, with noise; its position in counts.
void write_recording(const std::filesystem::path& file, std::size_t samples, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 0.02);
  fmt::memory_buffer text;
  fmt::format_to(std::back_inserter(text),
                 "# encoder_counts: {}\n# current_hold: none\ntime_s,current_a,motor_position_rad\n", kCounts);
  std::ofstream out(file, std::ios::binary);
  const double per_count = 2.0 * std::numbers::pi / kCounts;
  for (std::size_t k = 0; k < samples; ++k) {
    const double t = static_cast<double>(k) / kSampleHz;
    double q = 0.0, w = 0.0, a = 0.0;
    for (const auto& [size, hz] : {std::pair{4.0, 0.7}, std::pair{2.0, 1.9}, std::pair{0.6, 5.3}}) {
      const double rate = 2.0 * std::numbers::pi * hz;
      q += size * std::sin(rate * t);
      w += size * rate * std::cos(rate * t);
      a -= size * rate * rate * std::sin(rate * t);
    }
    const double torque = 1.04e-4 * a + 3.6e-4 * w + 2e-5 * std::abs(w) + std::copysign(0.045, w);
    fmt::format_to(std::back_inserter(text), "{:.3f},{:.5f},{:.7f}\n", t, torque / kTorqueConstant + noise(random),
                   std::round(q / per_count) * per_count);
    if (text.size() > 1U << 20) {
      out.write(text.data(), static_cast<std::streamsize>(text.size()));
      text.clear();
    }
  }
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
}

model::Model open_model() {
  model::Model model;
  model.drive.gear_ratio.value = 100.0;
  model.drive.torque_constant_nm_a.value = kTorqueConstant;
  for (const std::string& name : kEffects)
    model.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return model;
}

estimation::PipelineOptions options() {
  estimation::PipelineOptions options;
  options.cutoff_hz = kCutoffHz;
  options.mask = false;
  return options;
}

double median_ms(int runs, const std::function<void()>& work) {
  std::vector<double> times;
  for (int i = 0; i < runs; ++i) {
    const std::clock_t start = std::clock();
    work();
    times.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::nth_element(times.begin(), times.begin() + runs / 2, times.end());
  return times[static_cast<std::size_t>(runs / 2)];
}

double peak_bytes() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  return 1024.0 * static_cast<double>(used.ru_maxrss);
}

double peak_of(const std::string& command) {
  double bytes = NAN;
  if (FILE* const from = popen(command.c_str(), "r")) {
    if (std::fscanf(from, "%lf", &bytes) != 1) bytes = NAN;
    pclose(from);
  }
  return bytes;
}

struct Figures {
  double read_ms = NAN, identify_ms = NAN, read_bytes = NAN, all_bytes = NAN;
  double position_sum = NAN;
  std::vector<double> values;
};

// What a peer wrote: the figures in the order of Figures, then the parameters.
Figures peer_figures(const std::string& command, const std::filesystem::path& answer) {
  Figures f;
  std::filesystem::remove(answer);
  if (std::system(command.c_str()) != 0) return f;
  std::ifstream in(answer);
  in >> f.read_ms >> f.identify_ms >> f.read_bytes >> f.all_bytes >> f.position_sum;
  for (double x = 0.0; in >> x;) f.values.push_back(x);
  return f;
}

// Largest difference of the parameters, of each its own size.
double apart(const Figures& a, const Figures& b) {
  if (a.values.size() != b.values.size()) return INFINITY;
  double most = std::abs(a.position_sum - b.position_sum) / std::abs(a.position_sum);
  for (std::size_t i = 0; i < a.values.size(); ++i)
    most = std::max(most, std::abs(a.values[i] - b.values[i]) / std::abs(b.values[i]));
  return most;
}

void print(const char* who, const Figures& f, double raw) {
  fmt::print(
      "  {:14} read {:9.1f} ms  identify {:9.1f} ms  peak of memory {:5.2f} times the numbers to read, {:5.2f} in "
      "all\n",
      who, f.read_ms, f.identify_ms, f.read_bytes / raw, f.all_bytes / raw);
  std::fflush(stdout);
}

struct Peer {
  const char* name;
  std::string command;
  const char* read_goal;
  const char* identify_goal;
};

Figures library(const std::string& self, const std::filesystem::path& folder, int runs) {
  const std::filesystem::path file = folder / "data.csv";
  Figures f;
  data::Dataset dataset;
  f.read_ms = median_ms(runs, [&] { dataset = data::load({file}); });
  const model::Model model = open_model();
  std::unique_ptr<estimation::Identification> found;
  f.identify_ms = median_ms(runs, [&] {
    found.reset();
    found = estimation::identify(dataset, model, options());
  });
  for (const double q : dataset.experiments[0][data::Column::motor_position]) {
    if (std::isnan(f.position_sum)) f.position_sum = 0.0;
    f.position_sum += std::abs(q);
  }
  for (const std::string& name : kEffects)
    for (const estimation::Estimate& e : found->estimates)
      if (e.effect == name) f.values.push_back(e.value);
  // What a peer has to know of the recipe: its filter, the width of the sign, and which samples are rows.
  const estimation::PreparedData& p = found->prepared;
  const auto& rows = p.records[0].rows[estimation::index(Balance::motor)].samples;
  std::ofstream(folder / "about.txt") << fmt::format("{:.17g} {:.17g} {:.17g} {:.17g} {} {} {} {}\n", kSampleHz,
                                                     kCutoffHz, kTorqueConstant,
                                                     p.records[0].velocity_noise[estimation::index(Balance::motor)],
                                                     rows.front(), p.records[0].decimation, rows.size(), runs);
  found.reset();
  dataset = {};
  f.read_bytes = peak_of(fmt::format("{} read {}", self, file.string()));
  f.all_bytes = peak_of(fmt::format("{} identify {}", self, file.string()));
  return f;
}

// Exponent of a power law through the first and the last.
double slope(double x0, double y0, double x1, double y1) {
  return std::log(y1 / y0) / std::log(x1 / x0);
}

int compare(const std::string& self, const std::vector<Peer>& peers) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "flexspline-identify-bench";
  std::filesystem::create_directories(folder);
  const std::filesystem::path answer = folder / "answer.txt";
  bool same = true;
  std::map<std::size_t, Figures> ours;
  for (const std::size_t samples : {std::size_t{100000}, std::size_t{1000000}, std::size_t{10000000}}) {
    const std::string size = fmt::format("1e{:.0f} samples", std::log10(static_cast<double>(samples)));
    write_recording(folder / "data.csv", samples, 1);
    const double raw = 24.0 * static_cast<double>(samples);  // three columns of double
    fmt::print("{}: a CSV of three columns; two filters, four columns, least squares\n", size);
    const Figures& own = ours[samples] = library(self, folder, samples > 1000000 ? 3 : 5);
    print("flexspline", own, raw);
    for (const Peer& peer : peers) {
      const Figures f = peer_figures(peer.command + " " + folder.string(), answer);
      print(peer.name, f, raw);
      const double away = apart(f, own);
      same = same && away < 1e-6;
      fmt::print("                 {:.2f} and {:.2f} times the library's; parameters differ by {:.1e}\n",
                 f.read_ms / own.read_ms, f.identify_ms / own.identify_ms, away);
      bench::row("reading CSV, " + size, peer.name, peer.read_goal, f.read_ms / own.read_ms);
      bench::row("identification, " + size, peer.name, peer.identify_goal, f.identify_ms / own.identify_ms);
    }
    if (samples == 10000000) {
      bench::row("peak of memory reading CSV, " + size, "the raw numbers", "at most 2.5", own.read_bytes / raw);
      bench::row("peak of memory with identification, " + size, "the raw numbers", "at most 2.5", own.all_bytes / raw);
    }
  }
  const Figures& first = ours.begin()->second;
  const Figures& last = ours.rbegin()->second;
  const auto grows = [&](double y0, double y1) {
    return slope(static_cast<double>(ours.begin()->first), y0, static_cast<double>(ours.rbegin()->first), y1);
  };
  bench::row("growth of reading with samples", "exponent", "at most 1.1", grows(first.read_ms, last.read_ms));
  bench::row("growth of identification with samples", "exponent", "at most 1.1",
             grows(first.identify_ms, last.identify_ms));
  bench::row("growth of memory with samples", "exponent", "at most 1.1", grows(first.all_bytes, last.all_bytes));
  std::filesystem::remove_all(folder);
  if (!same) fmt::print("  another answer, or a peer could not be run\n");
  return same ? 0 : 1;
}

// Identification from several recordings of the same length.
void growth_with_experiments() {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "flexspline-experiments-bench";
  std::filesystem::create_directories(folder);
  std::map<std::size_t, double> ms;
  std::vector<std::filesystem::path> files;
  for (const std::size_t count : {std::size_t{4}, std::size_t{16}, std::size_t{64}}) {
    while (files.size() < count) {
      files.push_back(folder / fmt::format("{}.csv", files.size()));
      write_recording(files.back(), 20000, static_cast<unsigned>(files.size()));
    }
    const data::Dataset dataset = data::load(files);
    const model::Model model = open_model();
    ms[count] = median_ms(5, [&] { estimation::identify(dataset, model, options()); });
    fmt::print("{} experiments of 2e4 samples: identify {:.1f} ms\n", count, ms[count]);
  }
  std::filesystem::remove_all(folder);
  bench::row("growth of identification with experiments", "exponent", "at most 1.1", slope(4, ms[4], 64, ms[64]));
}

}  // namespace
}  // namespace flexspline

int main(int argc, char** argv) {
  using namespace flexspline;
  const std::string first = argc > 1 ? argv[1] : "";
  if (argc == 3 && (first == "read" || first == "identify")) {
    const data::Dataset dataset = data::load({argv[2]});
    if (first == "identify") estimation::identify(dataset, open_model(), options());
    fmt::print("{:.0f}\n", peak_bytes());
    return 0;
  }
  std::vector<Peer> peers;
  if (argc == 4) {
    const std::string folder = argv[3];
    // One core each: their libraries would take all.
    const std::string one = "OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 ";
    peers.push_back({"NumPy, SciPy", one + first + " " + folder + "/identify.py", "at least 5", "at least 8"});
    peers.push_back(
        {"GNU Octave", one + argv[2] + " --no-gui --quiet --norc " + folder + "/identify.m", "-", "at least 12"});
  }
  const int code = compare(argv[0], peers);
  growth_with_experiments();
  return code;
}
