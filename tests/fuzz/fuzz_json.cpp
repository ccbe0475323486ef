// Result files: any text gives either a value that is written and read back unchanged, or an Error.
#include "harness.hpp"
#include "whirl/io/model_json.hpp"

namespace {

template <class T>
void read(const whirl::io::Json& document) {
  try {
    const T value = whirl::io::from_json<T>(document, "fuzz.json");
    const std::string once = whirl::to_json(value).dump();
    const std::string twice =
        whirl::to_json(whirl::io::from_json<T>(whirl::io::parse_json(once, "once"), "once")).dump();
    if (once != twice) std::abort();
  } catch (const whirl::Error& e) {
    // What was written must be readable: an error may only concern the input.
    if (std::string_view(e.what()).substr(0, 5) == "once:") std::abort();
  }
}

}  // namespace

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const io::Json document = io::parse_json(bytes, "fuzz.json");
    require(io::parse_json(document.dump(), "once").dump() == document.dump());
    read<IdentifiedModel>(document);
    read<ControllerDesign>(document);
    read<ModalModel>(document);
    read<FrequencyResponse>(document);
    read<StiffnessLaw>(document);
  });
}
