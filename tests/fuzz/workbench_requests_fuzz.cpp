// What anybody may ask of the workbench: who gets in, which files a name may mean, and requests of the page in any
// order and with any content. Each gets an answer that can be read, and nothing is written outside the folder for
// models.
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "host/app/workbench/access_control.hpp"
#include "host/app/workbench/api.hpp"
#include "host/app/workbench/work.hpp"
#include "host/input/data/dataset.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "tests/fuzz/readers.hpp"

namespace {

namespace fs = std::filesystem;
using namespace flexspline;
using nlohmann::json;
using tests::require;

constexpr const char* kToken = "0123456789abcdef0123456789abcdef";
constexpr int kPort = 4711;
constexpr std::size_t kMostRequests = 24;

const std::string kModel = tests::kBeginningOfModel + R"([[effect]]
type = "coulomb_friction"
parameters.torque = 0.02
)";

// A quarter of a second of a drive's motor alone.
std::string some_record() {
  std::string csv = "time_s,current_a,motor_position_rad\n";
  for (int k = 0; k < 250; ++k) {
    const double t = 1e-3 * k, w = 2.0 * 3.14159265 * 8.0;
    const double position = std::sin(w * t), velocity = w * std::cos(w * t), acceleration = -w * w * position;
    const double torque = 1e-4 * acceleration + 3.6e-4 * velocity + (velocity < 0.0 ? -0.02 : 0.02);
    csv += std::to_string(t) + "," + std::to_string(torque / 0.05) + "," + std::to_string(position) + "\n";
  }
  return csv;
}

struct Bench {
  tests::ScratchFolder place;
  fs::path folder = place.path() / "models";
  std::unique_ptr<workbench::Api> api;

  Bench() {
    fs::create_directory(folder);
    const auto file = place.write("data.csv", some_record());
    workbench::Setup setup;
    setup.first =
        workbench::open(std::make_shared<data::Dataset>(data::load({file})),
                        model::parse(kModel, "model", catalogue::known_effects()), {}, [](std::string_view) {});
    setup.folder = folder;
    setup.run = [](const auto&) -> std::vector<closed_loop::Outcome> { throw std::runtime_error("no twin here"); };
    api = std::make_unique<workbench::Api>(std::move(setup));
  }
  // A job that was cancelled may be about to end a file: "better.toml.mkSKFA" gets its name in the next moment. False:
  // it stays.
  static bool is_renamed(const fs::path& file) {
    for (int tries = 0; tries < 500 && fs::exists(file); ++tries)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return !fs::exists(file);
  }

  // Nothing but models, reports and blocks under plain names, and nothing else where the folder is.
  void require_tidy() const {
    for (const auto& entry : fs::directory_iterator(place.path()))
      require(entry.path() == folder || entry.path().filename() == "data.csv", "a file outside the folder");
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      const bool is_known = name.ends_with(".toml") || name.ends_with(".html") || name.ends_with(".block");
      if (!is_known && is_renamed(entry.path())) continue;
      require(entry.is_regular_file() && name[0] != '.', "something else than a plain file: " + name);
      require(is_known, "a strange file: " + name);
    }
  }
};

std::string_view cut(std::string_view& rest, char at) {
  const std::size_t end = std::min(rest.find(at), rest.size());
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(std::min(end + 1, rest.size()));
  return part;
}

// "HOST\tORIGIN\tPATH"
void request(std::string_view line) {
  const std::string_view host = cut(line, '\t'), origin = cut(line, '\t');
  if (!workbench::refusal({host, origin, line}, kToken, kPort).empty()) return;
  std::string lower(host);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  require(lower == "127.0.0.1:4711" || lower == "localhost:4711", "another host gets in: " + std::string(host));
  require(origin.empty() || origin == "http://127.0.0.1:4711" || origin == "http://localhost:4711",
          "another origin gets in: " + std::string(origin));
  require(line.starts_with(std::string("/") + kToken + "/"), "somebody without the token gets in");
  require(workbench::behind_token(line).starts_with('/'), "a path that is none");
}

void name_of_a_file(const fs::path& folder, std::string_view name) {
  try {
    const fs::path path = workbench::inside(folder, name, ".toml");
    require(path.parent_path() == folder && path.filename() == name && name.ends_with(".toml") && name[0] != '.',
            "a name leads elsewhere: " + std::string(name));
  } catch (const workbench::NameError&) {
  }
}

// What costs seconds, or reaches for devices and other machines; none of it reads more of a request than its name.
bool is_left_out(const workbench::Request& request) {
  if (request.path == "/api/file") return request.query.contains("what") && request.query.at("what") != "model";
  const json asked = json::parse(request.body, nullptr, false);
  if (!asked.is_object() || !asked.contains("do") || !asked["do"].is_string()) return false;
  static const std::set<std::string> kLong = {"connect", "diagnose", "pack", "flash", "try"};
  const bool saves = asked["do"] == "save" && asked.contains("what") && asked["what"] != "model";
  return saves || kLong.contains(asked["do"].get<std::string>());
}

// "G PATH?KEY=VALUE&...\tBODY", P for POST, D for POST with the body as a dropped file of the name in key `name`.
void ask(workbench::Api& api, const std::string& tab, std::string_view line) {
  workbench::Request request;
  request.method = line[0] == 'G' ? "GET" : line[0] == 'X' ? "PUT" : "POST";
  const bool drops = line[0] == 'D';
  line.remove_prefix(std::min<std::size_t>(2, line.size()));
  std::string_view address = cut(line, '\t');
  request.path = cut(address, '?');
  while (!address.empty()) {
    std::string_view pair = cut(address, '&');
    const std::string key(cut(pair, '='));
    request.query.emplace(key, pair);
  }
  request.query.emplace("tab", tab);
  // It waits for news.
  if (const auto seen = request.query.find("seen"); seen != request.query.end()) {
    double value = 0.0;
    std::from_chars(seen->second.data(), seen->second.data() + seen->second.size(), value);
    if (value > 0.0) seen->second = "0";
  }
  if (drops) {
    request.path = "/api/drop";
    request.files.push_back({request.query.contains("name") ? request.query.at("name") : "a.csv", std::string(line)});
  } else {
    request.body = line;
  }
  if (is_left_out(request)) return;
  const workbench::Answer answer = api.answer(request);
  require(answer.status == 200 || answer.status == 400 || answer.status == 404 || answer.status == 409,
          "a status that the page does not know");
  if (answer.type == "application/json") {
    const json body = json::parse(answer.body, nullptr, false);
    require(!body.is_discarded(), "an answer that is no JSON: " + answer.body.substr(0, 200));
    require(answer.status == 200 || (body.contains("what") && body["what"] != ""),
            "a refusal without a reason: " + answer.body.substr(0, 200));
  }
}

}  // namespace

// Lines: K somebody knocks, N the name of a file, all others requests of one tab.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static Bench bench;
  std::string_view text(reinterpret_cast<const char*>(bytes), size);
  const json tab = json::parse(bench.api->answer({"POST", "/api/tab", {}, "", {}}).body);
  const std::string id = tab.at("tab").get<std::string>();
  for (std::size_t n = 0; !text.empty() && n < kMostRequests; ++n) {
    std::string_view line = cut(text, '\n');
    if (line.empty()) continue;
    if (line[0] == 'K')
      request(line.substr(std::min<std::size_t>(2, line.size())));
    else if (line[0] == 'N')
      name_of_a_file(bench.folder, line.substr(std::min<std::size_t>(2, line.size())));
    else
      ask(*bench.api, id, line);
  }
  bench.api->answer({"POST", "/api/do", {{"tab", id}}, R"({"do": "cancel"})", {}});
  bench.require_tidy();
  for (const auto& entry : fs::directory_iterator(bench.folder)) fs::remove(entry.path());
  return 0;
}
