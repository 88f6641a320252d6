// What the data show of the drive without a model: the answer of the command `measure`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/engine/measurement/distortion.hpp"
#include "host/engine/measurement/frequency_response.hpp"
#include "host/engine/measurement/noise.hpp"
#include "host/engine/measurement/resonance.hpp"
#include "host/input/data/dataset.hpp"

namespace flexspline::measurement {

struct FrequencyResponse {
  std::string input, output;
  std::string unit;  // of the output over the input
  data::Load load = data::Load::free;
  bool by_periods = false;  // else Welch's average
  double resolution_hz = 0.0;
  std::size_t records = 1;
  std::vector<ResponseLine> lines;  // excited ones with at least two averages

  std::size_t trusted() const;
};

// One experiment.
struct RecordMeasurement {
  std::string name;
  data::Load load = data::Load::free;
  std::optional<Period> period;
  double sample_s = 0.0;
  double masked_percent = 0.0;
  std::string no_period;  // why; a sentence without a full stop, empty where there is one
  std::vector<FrequencyResponse> responses;
  std::vector<NoiseLevel> noise;
  std::string no_noise;  // what to record; empty where there is noise
  std::vector<Distortion> distortion;
};

struct PooledResponse {
  FrequencyResponse response;
  ResonanceSearch resonances;
};

struct Measurement {
  std::vector<RecordMeasurement> records;
  std::vector<PooledResponse> pooled;  // of records of one load, sample rate and kind of average; best first
  std::vector<std::string> notes;      // what could not be determined, and what to record; sentences
};

// `period_s` overrides the period that is searched for. Never throws for data that lack something: notes report it.
Measurement measure(const data::Dataset& dataset, std::optional<double> period_s = std::nullopt);

}  // namespace flexspline::measurement
