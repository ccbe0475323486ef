// JSON in the catalogue: whirl's own results. Of these, frequency responses can be converted.
#include "formats/format.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::io {

Format json_format() {
  Format f{
      FileFormat::json, "JSON", {".json"}, [](std::string_view head) { return without_blanks(head).starts_with("{"); }};
  f.read_responses = [](const std::filesystem::path& path, const ResponseOptions&) {
    return std::optional(load<FrequencyResponse>(path));
  };
  f.write_responses = [](const std::filesystem::path& path, const FrequencyResponse& frf) { save(path, frf); };
  return f;
}

}  // namespace whirl::io
