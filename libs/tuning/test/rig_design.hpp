#pragma once
#include <complex>
#include <string>

#include "design_parts.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// The rig's own model.
inline IdentifiedModel true_model(const rig::RigParameters& rig) {
  IdentifiedModel m;
  m.method = "stand-in";
  m.rotor = rig.true_model();
  return m;
}

/// The same without what differs from axis to axis.
inline IdentifiedModel round_model(const rig::RigParameters& rig) {
  IdentifiedModel m = true_model(rig);
  m.rotor->k1_conj = m.rotor->c_conj = 0;
  return m;
}

/// What an identification gives: stiffness 1 % off, damping 30 % high, unbalance 4 % and 0.07 rad off.
inline IdentifiedModel identified_model(const rig::RigParameters& rig) {
  IdentifiedModel m = round_model(rig);
  m.rotor->k1 *= 1.01;
  m.rotor->c *= 1.3;
  m.rotor->eps *= std::polar(0.96, 0.07);
  return m;
}

/// That law for a machine of that data sheet; the laws that adapt at the speed get no force fed forward.
inline DesignOptions options_of(const Hardware& hardware, const std::string& law = "pd",
                                const std::string& estimator = "kfe") {
  DesignOptions o;
  o.law = law;
  o.estimator = estimator;
  o.feedforward = !law.starts_with("pd_");
  o.hardware = hardware;
  return o;
}

/// With the numbers that a search starts from, and the supervision of a design; no certificate.
inline ControllerDesign watched_design(const IdentifiedModel& model, const DesignOptions& o) {
  ControllerDesign d = untuned_design(model, o);
  add_supervision(d, o);
  return d;
}

}  // namespace whirl::tuning
