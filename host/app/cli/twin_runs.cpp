#include "host/app/cli/twin_runs.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host/app/cli/twin_process.hpp"
#include "host/common/system/temporary_folder.hpp"
#include "host/engine/estimation/in_parallel.hpp"

namespace flexspline::cli {
namespace {

using closed_loop::Job;
using closed_loop::Outcome;
namespace fs = std::filesystem;

void write(const fs::path& file, const char* bytes, std::size_t count) {
  std::ofstream out(file, std::ios::binary);
  if (!out.write(bytes, static_cast<std::streamsize>(count)).flush())
    throw std::runtime_error(fmt::format("{}: cannot be written; is there space?", file.string()));
}
std::string content(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(fmt::format("{}: the twin left no such file", file.string()));
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

void name_drive(const Job& job, const std::string& plant_file, std::vector<std::string>& words) {
  words.insert(words.end(), {"--scenario", job.scenario});
  if (!plant_file.empty()) words.insert(words.end(), {"--plant", plant_file});
  if (!job.with.empty()) words.insert(words.end(), {"--with", fmt::format("{}", fmt::join(job.with, ","))});
  if (!job.hide.empty()) words.insert(words.end(), {"--hide", job.hide});
}

Outcome run_one(const Job& job, const fs::path& stem) {
  const std::string at = stem.string();
  std::string plant_file = job.plant_file;
  if (!job.plant.empty()) write(plant_file = at + ".plant.toml", job.plant.data(), job.plant.size());
  write(at + ".block", reinterpret_cast<const char*>(job.block.data()), job.block.size());
  std::vector<std::string> words{"drive", "--block", at + ".block", "--json", at + ".json"};
  name_drive(job, plant_file, words);
  words.insert(words.end(), {"--compensation", job.compensation ? "on" : "off", "--seed", std::to_string(job.seed)});
  if (job.tick_hz != closed_loop::kTwinTickHz) words.insert(words.end(), {"--tick-hz", std::to_string(job.tick_hz)});
  if (job.seconds > 0.0) words.insert(words.end(), {"--seconds", fmt::format("{:g}", job.seconds)});
  if (!job.processor.empty()) words.insert(words.end(), {"--processor", job.processor});
  if (job.keeps_trace) words.insert(words.end(), {"--trace", at + ".csv"});
  run_twin(words);
  Outcome out = closed_loop::outcome_of(nlohmann::json::parse(content(at + ".json")));
  if (job.keeps_trace) out.trace = closed_loop::trace_of(content(at + ".csv"));
  return out;
}

}  // namespace

closed_loop::Runner twin_runner() {
  return [](const std::vector<Job>& jobs) {
    const system::TemporaryFolder folder;
    std::vector<Outcome> outcomes(jobs.size());
    estimation::in_parallel(jobs.size(),
                            [&](std::size_t i) { outcomes[i] = run_one(jobs[i], folder.path() / std::to_string(i)); });
    return outcomes;
  };
}

void fetch_data_sheet(const Job& job, const fs::path& folder) {
  std::vector<std::string> words{"data-sheet", "--out", folder.string()};
  name_drive(job, job.plant_file, words);
  run_twin(words);
}

}  // namespace flexspline::cli
