#include "responses.hpp"

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/io/frf_csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/io/uff.hpp"

namespace whirl::app {

FrfKind frf_kind(const std::string& name) {
  for (const FrfKind kind : {FrfKind::receptance, FrfKind::mobility, FrfKind::accelerance}) {
    if (to_string(kind) == name) return kind;
  }
  throw Error::in_field("--kind", name, "receptance, mobility or accelerance");
}

std::optional<FrequencyResponse> read_responses(const std::string& file, const std::string& kind) {
  switch (io::file_format(file)) {
    case io::FileFormat::json:
      return io::load<FrequencyResponse>(file);
    case io::FileFormat::uff: {
      const io::UffFile uff = io::read_uff(file);
      if (std::none_of(uff.functions.begin(), uff.functions.end(),
                       [](const io::UffFunction& f) { return f.type == 4; }))
        return {};
      return io::frf_from_uff(uff);
    }
    case io::FileFormat::csv: {
      const io::CsvStream stream(file);
      const bool spectra = std::any_of(stream.columns().begin(), stream.columns().end(),
                                       [](const io::CsvColumn& c) { return c.name == "freq"; });
      if (!spectra) return {};
      if (kind.empty())
        throw Error::in_file(file, 1, "a table of frequency responses does not say what was measured: state --kind");
      return io::read_frf_csv(file, frf_kind(kind));
    }
    default:
      return {};
  }
}

}  // namespace whirl::app
