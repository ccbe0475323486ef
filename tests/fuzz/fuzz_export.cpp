// `whirl export` of a model or a controller that somebody else wrote. Oracle: the source has the tokens that it has
// with every free text of the file replaced by a harmless one.
#include <string>
#include <utility>
#include <vector>

#include "harness.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/testing/source/tokens.hpp"

namespace {

using namespace whirl;
using Tokens = std::vector<std::pair<std::string, std::string>>;

/// Tokens of every form that the file can have.
template <class T>
Tokens tokens_of(const T& value, const std::string& origin) {
  Tokens out;
  const deploy::CodeOptions options{"plant", false, origin};
  const auto add = [&](const std::string& form, auto&& files) {
    fuzz::only_errors([&] {
      for (const deploy::SourceFile& f : files())
        out.emplace_back(form + " " + f.name, whirl::testing::tokens(f.name, f.text));
    });
  };
  for (const char* form : {"c", "latex", "matlab", "python", "sfunction", "modelica"})
    add(form, [&] { return deploy::source_files(value, form, options); });
  for (const int version : {2, 3}) {
    deploy::FmuOptions fmu;
    fmu.code = options;
    fmu.version = version;
    fmu.model_exchange = std::is_same_v<T, IdentifiedModel>;
    add("fmu", [&] { return deploy::fmu_files(value, fmu); });
  }
  return out;
}

void calm(Summary& summary, Provenance& provenance) {
  summary = {};
  provenance = {"0.2.0", {"a.csv"}, "options", provenance.seed};
}

void calm(IdentifiedModel& m) {
  calm(m.summary, m.provenance);
  m.method = "weak";
  for (std::size_t i = 0; i < m.parameters.size(); ++i) m.parameters[i].first = "p" + std::to_string(i);
  m.ambiguities.clear();
  m.noise_correlation.clear();
}
void calm(ControllerDesign& d) { calm(d.summary, d.provenance); }

template <class T>
void same_tokens(const io::Json& document, const std::string& origin) {
  fuzz::only_errors([&] {
    const T read = io::from_json<T>(document, "fuzz.json");
    T harmless = read;
    calm(harmless);
    fuzz::require(tokens_of(read, origin) == tokens_of(harmless, "a.json"));
  });
}

}  // namespace

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const io::Json document = io::parse_json(bytes, "fuzz.json");
    const std::string origin(bytes.substr(0, 200));
    same_tokens<IdentifiedModel>(document, origin);
    same_tokens<ControllerDesign>(document, origin);
  });
}
