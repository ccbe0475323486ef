#include "whirl/identify/rotor_angle.hpp"

#include <string>
#include <vector>

#include "whirl/io/remarks.hpp"
#include "whirl/signal/tacho.hpp"

namespace whirl::identification {

Recording with_angle_from_pulses(const Recording& record, const std::string& pulses,
                                 const signal::TachoOptions& tacho) {
  std::vector<std::string> said;
  Recording out = signal::with_tacho_angle(record, pulses, tacho, said);
  for (const std::string& text : said) io::remark(record.source, text);
  return out;
}

}  // namespace whirl::identification
