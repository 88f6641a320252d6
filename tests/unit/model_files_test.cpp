// Model files on disk.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "host/physics/model/model.hpp"
#include "tests/unit/model_some_effects.hpp"

namespace flexspline::model::model_files_test {
namespace {

namespace fs = std::filesystem;

class ModelFiles : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "model_files_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override {
    fs::permissions(folder_, fs::perms::owner_all);
    fs::remove_all(folder_);
  }

  static std::string content(const fs::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  template <typename Call>
  static std::string error_of(Call call) {
    try {
      call();
    } catch (const ModelError& error) {
      return error.what();
    }
    return "no error";
  }

  fs::path folder_;
};

const std::string kText = "format = \"flexspline-model/1\"\nname = \"x\"\n";

TEST_F(ModelFiles, WhatIsSavedIsReadAndNothingElseStaysInTheFolder) {
  save(folder_ / "m.toml", kText);
  save(folder_ / "m.toml", kText + "# second\n");
  const ModelFile file = read(folder_ / "m.toml", SomeEffects());
  EXPECT_EQ(file.text, kText + "# second\n");
  EXPECT_EQ(file.model.name, "x");
  EXPECT_EQ(files(), 1U);
}

TEST_F(ModelFiles, AReplacedFileKeepsItsPermissionsAndALinkStaysALink) {
  save(folder_ / "m.toml", "old");
  ASSERT_EQ(::chmod((folder_ / "m.toml").c_str(), 0640), 0);
  fs::create_symlink("m.toml", folder_ / "link.toml");
  save(folder_ / "link.toml", kText);
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.toml"));
  EXPECT_EQ(content(folder_ / "m.toml"), kText);
  EXPECT_EQ(fs::status(folder_ / "m.toml").permissions(), static_cast<fs::perms>(0640));
}

TEST_F(ModelFiles, ErrorsOfSavingNamePathAndReason) {
  const fs::path missing = folder_ / "none" / "m.toml";
  const std::string no_folder = error_of([&] { save(missing, kText); });
  EXPECT_NE(no_folder.find(missing.string()), std::string::npos) << no_folder;
  EXPECT_NE(no_folder.find("create the folder"), std::string::npos) << no_folder;

  save(folder_ / "file", "x");
  const std::string not_a_folder = error_of([&] { save(folder_ / "file" / "m.toml", kText); });
  EXPECT_NE(not_a_folder.find("a part of the path is a file"), std::string::npos) << not_a_folder;

  fs::create_directory(folder_ / "sub");
  const std::string a_folder = error_of([&] { save(folder_ / "sub", kText); });
  EXPECT_NE(a_folder.find("this is a folder"), std::string::npos) << a_folder;
  EXPECT_NE(error_of([&] { save({}, kText); }).find("no name"), std::string::npos);
  EXPECT_EQ(files(), 2U);
}

TEST_F(ModelFiles, AFolderThatMayNotBeWrittenIsNamedAndTheOldFileStays) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  save(folder_ / "m.toml", kText);
  fs::permissions(folder_, fs::perms::owner_read | fs::perms::owner_exec);
  const std::string message = error_of([&] { save(folder_ / "m.toml", "new"); });
  EXPECT_NE(message.find("a folder that is yours"), std::string::npos) << message;
  EXPECT_EQ(content(folder_ / "m.toml"), kText);
}

TEST_F(ModelFiles, ErrorsOfReadingNameThePath) {
  const fs::path path = folder_ / "m.toml";
  const std::string missing = error_of([&] { read(path, SomeEffects()); });
  EXPECT_NE(missing.find(path.string() + ": there is no such model file"), std::string::npos) << missing;
  const std::string a_folder = error_of([&] { read(folder_, SomeEffects()); });
  EXPECT_NE(a_folder.find("this is a folder"), std::string::npos) << a_folder;
  save(path, kText + "x = \n");
  const std::string wrong = error_of([&] { read(path, SomeEffects()); });
  EXPECT_TRUE(wrong.starts_with(path.string() + ":3: ")) << wrong;
}

}  // namespace
}  // namespace flexspline::model::model_files_test
