// `whirl identify`: library.toml and model.json. Oracles: a library is written and read back unchanged, also one with
// other equations sought; a model that is read gives the same source of its equations before and after it is written.
#include <string>
#include <vector>

#include "harness.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/io/library_toml.hpp"
#include "whirl/io/model_json.hpp"

namespace {

void library(std::string_view bytes) {
  using namespace whirl;
  for (const std::vector<std::string>& sought : {std::vector<std::string>{}, {"x''", "y''"}}) {
    expr::CandidateLibrary read;
    if (!fuzz::only_errors([&] { read = io::parse_library_toml(bytes, "fuzz.toml", sought); })) continue;
    const std::string once = io::to_toml(read);
    fuzz::require(io::to_toml(io::parse_library_toml(once, "once")) == once);
  }
}

void model(std::string_view bytes) {
  using namespace whirl;
  fuzz::only_errors([&] {
    const auto read = io::from_json<IdentifiedModel>(io::parse_json(bytes, "fuzz.json"), "fuzz.json");
    const auto again = io::from_json<IdentifiedModel>(io::to_json(read), "again");
    const deploy::CodeOptions options{"plant", false, "model.json"};
    const auto first = deploy::source_files(read, "c", options), second = deploy::source_files(again, "c", options);
    fuzz::require(first.size() == second.size());
    for (std::size_t i = 0; i < first.size(); ++i) fuzz::require(first[i].text == second[i].text);
  });
}

}  // namespace

void whirl::fuzz::run(std::string_view bytes) {
  if (bytes.starts_with("{"))
    model(bytes);
  else
    library(bytes);
}
