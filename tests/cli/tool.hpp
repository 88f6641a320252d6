// The program as a user runs it: in a folder of its own, by a shell, with its answers caught.
#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

namespace flexspline::cli_test {

namespace fs = std::filesystem;

struct Answer {
  int code = -1;
  std::string out;
  std::string err;
};

inline std::string content_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

// A folder that is empty at first and gone afterwards; commands run in it.
class Shell {
 public:
  Shell() {
    std::string path = (fs::temp_directory_path() / "flexspline-test-XXXXXX").string();
    if (::mkdtemp(path.data()) == nullptr) throw std::runtime_error("no temporary folder");
    root_ = path;
    // A blank in the path, as users have.
    folder_ = root_ / "a folder";
    fs::create_directories(folder_);
  }
  Shell(const Shell&) = delete;
  Shell& operator=(const Shell&) = delete;
  ~Shell() {
    std::error_code ignored;
    fs::remove_all(root_, ignored);
  }

  const fs::path& folder() const { return folder_; }
  std::string file(const std::string& name) const { return content_of(folder_ / name); }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  // A line as it is typed; flexspline and flexspline-hil are on the path.
  Answer run(const std::string& line) const {
    const fs::path bin = fs::path(FLEXSPLINE_TOOL).parent_path();
    const std::string script = "cd '" + folder_.string() + "' && export XDG_STATE_HOME='" + (root_ / "state").string() +
                               "' && PATH='" + bin.string() + "':\"$PATH\" && { " + line + "\n} >'" +
                               (root_ / "out").string() + "' 2>'" + (root_ / "err").string() + "' </dev/null";
    const int status = std::system(script.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(root_ / "out"), content_of(root_ / "err")};
  }

  // Runs a line that must succeed.
  std::string must(const std::string& line) const {
    const Answer answer = run(line);
    EXPECT_EQ(answer.code, 0) << line << "\n" << answer.err;
    return answer.out;
  }

  // Runs a line with `--json -`: nothing but JSON may come on standard output.
  nlohmann::json json(const std::string& line) const {
    const std::string text = must(line + " --json -");
    const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << line << "\n" << text;
    return json;
  }

  // Measurements of a drive whose base model lacks `hidden`; made once in this process, and copied.
  void record(const std::string& hidden = "viscous_asymmetry") const {
    static std::map<std::string, Shell> recorded;
    const auto [made, is_new] = recorded.try_emplace(hidden);
    if (is_new) made->second.must("flexspline-hil record --out demo-out --seed 1 --hide " + hidden);
    fs::copy(made->second.folder(), folder_, fs::copy_options::recursive);
  }
  // The same, and its base model fitted to all of them.
  void record_and_identify() const {
    static std::optional<Shell> identified;
    if (!identified) {
      identified.emplace().record();
      identified->must("flexspline identify demo-out --model demo-out/base-model.toml --out fitted.toml");
    }
    fs::copy(identified->folder(), folder_, fs::copy_options::recursive);
  }

 private:
  fs::path root_;
  fs::path folder_;
};

inline bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

// Field names of an object, in order, to compare with what the contract lists.
inline void expect_fields(const nlohmann::json& object, std::initializer_list<const char*> names) {
  for (const char* name : names) EXPECT_TRUE(object.contains(name)) << name << " in " << object.dump().substr(0, 300);
}

}  // namespace flexspline::cli_test
