// Result files: any text gives either a value that is written and read back unchanged, or an Error.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "whirl/core/error.hpp"
#include "whirl/io/model_json.hpp"

namespace {

template <class T>
void read(const whirl::Json& document) {
  try {
    const T value = whirl::from_json<T>(document, "fuzz.json");
    const std::string once = whirl::to_json(value).dump();
    const std::string twice =
        whirl::to_json(whirl::from_json<T>(whirl::parse_json(once, "once"), "once")).dump();
    if (once != twice) std::abort();
  } catch (const whirl::Error& e) {
    // What was written must be readable: an error may only concern the input.
    if (std::string_view(e.what()).substr(0, 5) == "once:") std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    const whirl::Json document = whirl::parse_json({reinterpret_cast<const char*>(data), size}, "fuzz.json");
    if (whirl::parse_json(document.dump(), "once").dump() != document.dump()) std::abort();
    read<whirl::IdentifiedModel>(document);
    read<whirl::ControllerDesign>(document);
    read<whirl::ModalModel>(document);
    read<whirl::FrequencyResponse>(document);
    read<whirl::StiffnessLaw>(document);
  } catch (const whirl::Error&) {
  }
  return 0;
}
