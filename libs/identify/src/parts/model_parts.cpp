#include "whirl/identify/parts/model_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "terms/catalogue.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/drive.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/identify/tilt/tilt_rotor.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::identification {
namespace {

constexpr std::array<std::string_view, kModelParts> kPartNames{"cubic spring",
                                                               "unequal axes",
                                                               "coupled damping",
                                                               "further modes",
                                                               "tilting disc",
                                                               "further forces",
                                                               "drift in time",
                                                               "force at twice the speed",
                                                               "unbalances of further records",
                                                               "changes of the machine between records",
                                                               "ringing at the start",
                                                               "runout",
                                                               "delay of the probes",
                                                               "errors of the probes",
                                                               "readings within the intervals",
                                                               "readings with another force",
                                                               "covariance",
                                                               "noise",
                                                               "equations of another system",
                                                               "map",
                                                               "hidden states",
                                                               "timing of inputs",
                                                               "drive",
                                                               "velocity or acceleration in its records"};
constexpr std::array<std::string_view, kConsumers> kConsumerNames{"response", "runup",  "simulate", "validate",
                                                                  "balance",  "design", "margins",  "robustness",
                                                                  "compare",  "export", "report"};

bool numbered(std::string_view name, std::string_view stem) {
  return name.starts_with(stem) && name.size() > stem.size() &&
         std::isdigit(static_cast<unsigned char>(name[stem.size()])) != 0;
}

Amount amount_of(const std::string& name, const Estimate& e) {
  return {name, e.value, std::string(io::parameter_unit(name))};
}

/// Parameters by a rule on their names.
template <class Rule>
std::vector<Amount> amounts_where(const IdentifiedModel& model, const Rule& rule) {
  std::vector<Amount> out;
  for (const auto& [name, e] : model.parameters)
    if (rule(name)) out.push_back(amount_of(name, e));
  return out;
}

std::vector<Amount> forces(const IdentifiedModel& model, ModelPart wanted) {
  std::vector<Amount> out;
  for (const RotorTerm& t : terms_of(model)) {
    if (part_of(t) != wanted || t.value == 0) continue;
    out.push_back({std::string(t.parameter()), t.value, std::string(t.unit())});
  }
  return out;
}

std::vector<Amount> modes(const IdentifiedModel& model) {
  std::vector<Amount> out;
  for (std::size_t k = 0; model.rotor && k < model.rotor->modes.size(); ++k) {
    const ForcedMode& m = model.rotor->modes[k];
    out.push_back({fmt::format("mode {}", k + 1), m.omega * kHzPerRadPerSec, "Hz"});
    out.push_back({"its share", std::abs(m.participation), "m"});
  }
  return out;
}

/// Every parameter that an alternative moves, from the model's value to its own.
std::vector<Amount> alternatives(const IdentifiedModel& model, bool covered) {
  std::vector<Amount> out;
  for (const Ambiguity& a : model.ambiguities) {
    if (a.covered != covered) continue;
    for (const Alternative& one : a.alternatives)
      for (const auto& [name, e] : one.parameters) out.push_back(amount_of(name, e));
  }
  return out;
}

bool has_ambiguity(const IdentifiedModel& model, bool covered) {
  return std::ranges::any_of(model.ambiguities, [&](const Ambiguity& a) { return a.covered == covered; });
}

std::vector<Amount> timings(const IdentifiedModel& model) {
  std::vector<Amount> out;
  for (const InputTiming& t : model.timing) out.push_back({t.input, t.dead_time.value, "s"});
  return out;
}

/// Its sizes where a model has the part; nothing where it has not.
std::optional<std::vector<Amount>> found(const IdentifiedModel& model, ModelPart part) {
  using Amounts = std::vector<Amount>;
  const auto where = [](bool present, Amounts amounts = {}) {
    return present ? std::optional<Amounts>(std::move(amounts)) : std::nullopt;
  };
  const auto any = [&](Amounts amounts) { return where(!amounts.empty(), amounts); };
  const RotorModel none, &rotor = model.rotor ? *model.rotor : none;
  switch (part) {
    case ModelPart::cubic_spring: {
      const Estimate* k2 = model.parameter("k2");
      const double size = model.rotor ? rotor.k2 : k2 != nullptr ? k2->value : 0;
      return where(size != 0, {{"k2", size, "1/(m^2 s^2)"}});
    }
    case ModelPart::unequal_axes:
      return where(rotor.k1_conj != 0.0 || rotor.c_conj.real() != 0,
                   {{"k1_conj", std::abs(rotor.k1_conj), "1/s^2"}, {"c_conj_re", rotor.c_conj.real(), "1/s"}});
    case ModelPart::coupled_damping:
      return where(rotor.c_conj.imag() != 0, {{"c_conj_im", rotor.c_conj.imag(), "1/s"}});
    case ModelPart::further_modes:
      return any(modes(model));
    case ModelPart::tilting_disc:
      return where(has_tilt(model), amounts_where(model, [](std::string_view n) { return n == "second_frequency"; }));
    case ModelPart::further_forces:
      return any(forces(model, ModelPart::further_forces));
    case ModelPart::drifts:
      return any(forces(model, ModelPart::drifts));
    case ModelPart::twice_speed:
      return any(forces(model, ModelPart::twice_speed));
    case ModelPart::other_unbalances:
      return any(amounts_where(model, [](std::string_view n) { return numbered(n, "e_"); }));
    case ModelPart::changed_machine:
      return any(amounts_where(
          model, [](std::string_view n) { return numbered(n, "k1_change_") || numbered(n, "c_change_"); }));
    case ModelPart::ringing:
      return any(
          amounts_where(model, [](std::string_view n) { return numbered(n, "decay") && n.ends_with("_omega"); }));
    case ModelPart::runout:
      return any(amounts_where(model, [](std::string_view n) { return numbered(n, "runout"); }));
    case ModelPart::sensor_delay:
      return any(amounts_where(model, [](std::string_view n) { return n == "delay"; }));
    case ModelPart::sensor_errors:
      return any(amounts_where(model, [](std::string_view n) { return n.starts_with("sensor_"); }));
    case ModelPart::covered_readings:
      return where(has_ambiguity(model, true), alternatives(model, true));
    case ModelPart::other_readings:
      return where(has_ambiguity(model, false), alternatives(model, false));
    case ModelPart::covariance:
      return where(!model.rotor_covariance.empty() || !model.parameter_covariance.empty());
    case ModelPart::noise:
      return where(model.noise_sd > 0 || !model.noise_correlation.empty(),
                   {{"noise_sd", model.noise_sd, std::string(si_unit(model.quantity))}});
    case ModelPart::equations:
      return where(!model.rotor && !has_tilt(model) && !model.equations.empty());
    case ModelPart::map:
      return where(!model.equations.empty() && model.equations.front().lhs.ends_with("[k+1]"));
    case ModelPart::hidden_states: {
      const auto hidden = std::ranges::count_if(model.states, [](const std::string& s) { return numbered(s, "h"); });
      return where(hidden > 0, {{"states", static_cast<double>(hidden)}});
    }
    case ModelPart::input_timing:
      return where(!model.timing.empty(), timings(model));
    case ModelPart::drive:
      return where(has_drive(model));
    case ModelPart::other_quantity:
      return where(model.quantity != Quantity::displacement,
                   {{"derivative of the displacement", model.quantity == Quantity::velocity ? 1.0 : 2.0}});
  }
  return {};
}

}  // namespace

std::string_view to_string(ModelPart part) { return kPartNames[static_cast<std::size_t>(part)]; }
std::string_view to_string(Consumer consumer) { return kConsumerNames[static_cast<std::size_t>(consumer)]; }
std::string_view to_string(Treatment treatment) {
  constexpr std::array<std::string_view, 4> names{"used", "noted", "warned", "refused"};
  return names[static_cast<std::size_t>(treatment)];
}

ModelPart part_of(const RotorTerm& term) {
  if (term.is(terms::twice_the_speed())) return ModelPart::twice_speed;
  return term.entry->drifts ? ModelPart::drifts : ModelPart::further_forces;
}

std::vector<PresentPart> parts_of(const IdentifiedModel& model) {
  std::vector<PresentPart> parts;
  for (std::size_t k = 0; k < kModelParts; ++k) {
    const auto part = static_cast<ModelPart>(k);
    if (std::optional<std::vector<Amount>> amounts = found(model, part)) parts.push_back({part, *std::move(amounts)});
  }
  return parts;
}

void take_parts(Consumer consumer, const IdentifiedModel& model, Summary& summary, std::string_view file) {
  const std::vector<PresentPart> parts = parts_of(model);
  for (const PresentPart& p : parts) {
    const PartUse use = use_of(consumer, p.part);
    if (use.treatment != Treatment::refused) continue;
    throw Error(
        fmt::format("{}: {} does not take a model with {}: {}", file, to_string(consumer), to_string(p.part), use.why));
  }
  for (const PresentPart& p : parts) {
    const PartUse use = use_of(consumer, p.part);
    if (use.treatment == Treatment::used) continue;
    const bool note = use.treatment == Treatment::noted;
    summary.add({FindingCode::part_left_out, note ? Consequence::note : Consequence::warning, p.amounts,
                 std::string(to_string(p.part))},
                fmt::format(": {}", use.why));
  }
}

std::string parts_table() {
  std::string out = "| part |";
  for (const std::string_view name : kConsumerNames) out += fmt::format(" `{}` |", name);
  out += "\n| --- |";
  for (std::size_t k = 0; k < kConsumers; ++k) out += " --- |";
  out += "\n";
  std::string notes;
  for (std::size_t p = 0; p < kModelParts; ++p) {
    out += fmt::format("| {} |", kPartNames[p]);
    std::vector<std::pair<std::string_view, std::string>> said;  // words, steps
    for (std::size_t c = 0; c < kConsumers; ++c) {
      const PartUse use = use_of(static_cast<Consumer>(c), static_cast<ModelPart>(p));
      out += fmt::format(" {} |", to_string(use.treatment));
      if (use.treatment == Treatment::used) continue;
      const std::string step = fmt::format("`{}`", kConsumerNames[c]);
      const auto same = std::ranges::find(said, use.why, &std::pair<std::string_view, std::string>::first);
      if (same == said.end())
        said.emplace_back(use.why, step);
      else
        same->second += ", " + step;
    }
    out += "\n";
    for (const auto& [why, steps] : said) notes += fmt::format("- **{}**, {}: {}\n", kPartNames[p], steps, why);
  }
  return out + "\n" + notes;
}

}  // namespace whirl::identification
