#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <regex>
#include <set>

#include "program.hpp"

namespace whirl::testing {
namespace {

namespace fs = std::filesystem;

/// Schemas of the JSON documents that the source starts: name/version and the files that do.
std::map<std::string, std::set<std::string>> written() {
  const std::regex start("start_document\\(\\s*\"(whirl\\.[a-z_-]+)\",\\s*([0-9]+)\\)");
  std::map<std::string, std::set<std::string>> found;
  for (const char* root : {"libs", "apps"}) {
    for (const auto& file : fs::recursive_directory_iterator(fs::path(source_dir()) / root)) {
      if (file.path().extension() != ".cpp" || file.path().string().find("/test/") != std::string::npos) continue;
      const std::string text = slurp(file.path());
      for (std::sregex_iterator it(text.begin(), text.end(), start), end; it != end; ++it)
        found[(*it)[1].str() + "/" + (*it)[2].str()].insert(file.path().filename().string());
    }
  }
  return found;
}

TEST(Schemas, EachSchemaIsDescribedAndNoneIsDescribedThatIsNotWritten) {
  const std::string docs = slurp(fs::path(source_dir()) / "docs/formats.md");
  const auto schemas = written();
  EXPECT_GE(schemas.size(), 20u);
  for (const auto& [name, files] : schemas)
    EXPECT_NE(docs.find("`" + name + "`"), std::string::npos) << name << " of " << *files.begin();
  const std::regex mention("`(whirl\\.[a-z_-]+/[0-9]+)`");
  for (std::sregex_iterator it(docs.begin(), docs.end(), mention), end; it != end; ++it) {
    const std::string name = (*it)[1];
    if (name == "whirl.loop/1") continue;                            // HDF5
    if (name == "whirl.plant/1" || name == "whirl.law/1") continue;  // others write them
    EXPECT_TRUE(schemas.count(name)) << name << " is described but not written";
  }
}

TEST(Schemas, ANameMeansOneThing) {
  std::map<std::string, std::string> versions;
  for (const auto& [name, files] : written()) {
    // The study's validation holds the runs of the same writer, with two keys more.
    if (name != "whirl.validation/1") {
      EXPECT_EQ(files.size(), 1u) << name;
    }
    const std::string bare = name.substr(0, name.find('/'));
    EXPECT_TRUE(versions.emplace(bare, name).second) << bare << " is written in two versions";
  }
  const std::string docs = slurp(fs::path(source_dir()) / "docs/formats.md");
  std::set<std::string> titles;
  const std::regex title("\n#+ [^\n]*`(whirl\\.[a-z_-]+/[0-9]+)`");
  for (std::sregex_iterator it(docs.begin(), docs.end(), title), end; it != end; ++it)
    EXPECT_TRUE(titles.insert((*it)[1]).second) << (*it)[1] << " has two sections";
}

}  // namespace
}  // namespace whirl::testing
