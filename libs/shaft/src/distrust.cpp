#include "whirl/shaft/distrust.hpp"

namespace whirl::shaft {

void carry_distrust(const Rotor& rotor, Consequence consequence, Summary& summary) {
  if (rotor.not_trusted.empty()) return;
  const bool contradicted = rotor.not_trusted == to_string(FindingCode::model_error);
  summary.add({FindingCode::model_not_trusted,
               consequence,
               {},
               contradicted ? "the records contradict its drawing" : "its fit ended at its limit of work"});
}

}  // namespace whirl::shaft
