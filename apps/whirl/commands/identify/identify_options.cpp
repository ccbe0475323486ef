#include "identify_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/expr/term_list.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/identify/sindy_library.hpp"
#include "whirl/io/library_toml.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/units.hpp"

namespace whirl::app {
namespace {

std::string strip(const std::string& text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// "INPUT=VALUE" or "VALUE" for every input.
std::vector<std::pair<std::string, std::string>> by_input(const std::string& text,
                                                          const std::vector<std::string>& inputs) {
  const auto equals = text.rfind('=');
  if (equals != std::string::npos) return {{strip(text.substr(0, equals)), strip(text.substr(equals + 1))}};
  std::vector<std::pair<std::string, std::string>> all;
  for (const std::string& input : inputs) all.emplace_back(input, strip(text));
  return all;
}

/// The columns as they were read, `angle` among them as beta.
std::string columns_with_beta(std::vector<std::string> columns, const Recording& like, const std::string& angle) {
  if (columns.empty())
    for (const char* name : {"x", "y"})
      if (like.has(name)) columns.emplace_back(name);
  std::string header = angle, out;
  for (const std::string& spec : columns) {
    const std::size_t colon = spec.rfind(':');
    const std::string name = io::split_unit(spec.substr(colon + 1)).name;  // the whole where there is no colon
    if (spec.starts_with(angle) && colon == std::string::npos) continue;
    if (colon != std::string::npos && (name == angle || spec.substr(colon + 1) == angle))
      header = spec.substr(0, colon);
    else
      out += spec.find_first_of(" ()[]*;&'$") == std::string::npos ? " " + spec : " \"" + spec + '"';
  }
  return out + " \"" + header + ":beta\"";
}

double seconds_of(const std::string& text) {
  std::size_t end = 0;
  double value = -1;
  try {
    value = std::stod(text, &end);
  } catch (const std::exception&) {
    end = 0;
  }
  if (end == 0 || end != text.size() || !(value >= 0))
    throw Error::in_field("--dead-time-s", text, "seconds >= 0, or INPUT=SECONDS");
  return value;
}

/// Which methods use a flag; one that is not here serves all.
struct Use {
  std::vector<std::string_view> methods, flags;
};
const std::vector<Use> kUses{
    {{"sindy"}, {"--states",      "--inputs", "--hold",      "--dead-time-s", "--no-timing", "--hidden",
                 "--denominator", "--order",  "--discrete",  "--degree",      "--fourier",   "--time",
                 "--library",     "--known",  "--sign",      "--window",      "--t-value",   "--stream",
                 "--max-passes",  "--bound",  "--stable-1s", "--trapping"}},
    {{"sindy", "second-order"}, {"--no-refine"}},
    {{"sindy", "second-order", "paper"},
     {"--terms", "--regressor", "--selection", "--threshold", "--lambda", "--ridge", "--max-terms", "--backward-t",
      "--nu", "--resamples", "--inclusion", "--drop-terms", "--folds", "--seed", "--debias"}},
    {{"second-order"}, {"--output-channel", "--input-channel"}},
    {{"paper", "consistent", "second-order"}, {"--filter-ms"}},
    {{"weak", "paper"}, {"--modes"}},
    {{"weak", "drive", "paper", "consistent"}, {"--pulses", "--missing", "--edge"}},
    {{"weak"}, {"--slow-roll", "--slow-roll-reads", "--angle"}},
    {{"drive"}, {"--drive", "--inertia-kgm2", "--mass-kg"}},
};

}  // namespace

identification::Method IdentifyFlags::method_chosen() const {
  if (!method.empty()) return identification::method_of(method);
  if (!drive.empty()) return identification::Method::drive;
  const bool general = hidden > 0 || !denominators.empty() || !states.empty() || !inputs.empty() ||
                       !term_list.empty() || !known.empty() || !library.empty() || !signs.empty() || !bounds.empty() ||
                       least_decay >= 0 || trapping || degree > 0 || fourier > 0 || discrete || time || stream;
  return general ? identification::Method::sindy : identification::Method::weak;
}

expr::CandidateLibrary IdentifyFlags::candidate_library(const Recording& like) const {
  const auto lhs_of = [&](const std::string& s) { return s + (discrete ? "[k+1]" : order == 2 ? "''" : "'"); };
  std::vector<std::string> sought;  // of a file that names no equation
  for (const std::string& s : sindy(like).states) sought.push_back(lhs_of(s));
  const expr::CandidateLibrary read = io::read_library(library, sought);
  // What the command line says beside the file must agree with it.
  const auto refuse = [&](const char* flag, const std::string& value) {
    throw Error::in_field(flag, value,
                          fmt::format("what {} says: equations of {}", library, fmt::join(read.lhs, ", ")));
  };
  const auto has = [](const std::vector<std::string>& list, const std::string& name) {
    return std::find(list.begin(), list.end(), name) != list.end();
  };
  for (const std::string& l : read.lhs) {
    const std::string state = l.substr(0, l.find_first_of("'["));
    const std::size_t primes = l.ends_with("[k+1]") ? 0 : l.size() - state.size();
    if (order > 0 && primes > 0 && primes != static_cast<std::size_t>(order)) refuse("--order", std::to_string(order));
    if (discrete && primes > 0) refuse("--discrete", "given");
    if (!states.empty() && !has(states, state)) refuse("--states", fmt::format("{}", fmt::join(states, ",")));
  }
  if (!states.empty() && states.size() != read.lhs.size())
    refuse("--states", fmt::format("{}", fmt::join(states, ",")));
  for (const std::string& i : inputs) {
    if (!has(read.variables, i))
      throw Error::in_field("--inputs", i, fmt::format("a name in {}: {}", library, fmt::join(read.variables, ", ")));
  }
  return read;
}

void IdentifyFlags::check(const std::vector<std::string>& given) const {
  const std::string m(to_string(method_chosen()));
  std::vector<std::string_view> running{m};
  if (compare && of_a_rotor()) running = {"weak", "paper", "consistent"};
  for (const Use& use : kUses) {
    const auto runs = [&](std::string_view one) { return std::ranges::find(running, one) != running.end(); };
    if (std::ranges::any_of(use.methods, runs)) continue;
    for (const std::string& flag : given)
      if (std::ranges::find(use.flags, flag) != use.flags.end() && (flag != "--angle" || angle != "measured"))
        throw Error(fmt::format("{} is for --method {}, not for {}", flag, fmt::join(use.methods, " or "), m));
  }
  if (trapping && least_decay >= 0) throw Error("--trapping and --stable-1s exclude each other");
  if (stream && (!bounds.empty() || least_decay >= 0 || trapping))
    throw Error("--stream takes none of --bound, --stable-1s, --trapping");
  if (drive.empty() && method_chosen() == identification::Method::drive)
    throw Error("--method drive needs --drive CHANNEL");
  if ((hidden > 0 || !denominators.empty()) && (stream || discrete || no_refine || !library.empty() || compare))
    throw Error("--hidden and --denominator take none of --stream, --discrete, --no-refine, --library, --compare");
  if (hidden > 0 && !denominators.empty()) throw Error("--hidden and --denominator exclude each other");
  if (inputs.empty() && (!holds.empty() || !dead_times.empty())) throw Error("--hold and --dead-time-s need --inputs");
  if (stream && (!holds.empty() || !dead_times.empty())) throw Error("--stream takes neither --hold nor --dead-time-s");
  if (compare && !slow_roll.empty()) throw Error("--compare takes no --slow-roll");
  if (slow_roll.empty() && slow_roll_reads != "unknown") throw Error("--slow-roll-reads needs --slow-roll FILE");
  if (angle == "vibration" && (record.tacho_stated() || !slow_roll.empty()))
    throw Error("--angle vibration takes neither --pulses nor --slow-roll");
}

std::vector<std::string> IdentifyFlags::required() const {
  using identification::Method;
  const Method m = method_chosen();
  if (m == Method::weak || m == Method::drive || m == Method::paper || m == Method::consistent)
    return {"x"};  // for the others see require_rotor_channels
  if (m == Method::second_order) return {output, input};
  std::vector<std::string> names = states;
  names.insert(names.end(), inputs.begin(), inputs.end());
  return names;
}

bool IdentifyFlags::of_a_rotor() const {
  using identification::Method;
  const Method m = method_chosen();
  return m == Method::weak || m == Method::drive || m == Method::paper || m == Method::consistent;
}

Recording IdentifyFlags::with_angle(const Recording& read) const {
  if (!of_a_rotor() || angle != "measured") return read;
  return identification::with_angle_from_pulses(read, "");
}

void IdentifyFlags::require_rotor_channels(const Recording& like) const {
  using identification::Method;
  if (!of_a_rotor()) return;
  const Method m = method_chosen();
  std::string present;
  for (const Channel& c : like.channels) present += (present.empty() ? "" : ", ") + c.name;
  // The default method takes one direction for a rotor whose axes are alike.
  if (!like.has("y") && (m != Method::weak || !like.has("x"))) {
    throw Error(fmt::format("{}: no column '{}' (with its unit, e.g. 'y_mm'); present: {}. {}", like.source,
                            m == Method::weak ? "x' or 'y" : "y", present,
                            m == Method::weak
                                ? "A rotor's motion needs at least one direction. Any other system than a rotor: name "
                                  "its states, and its inputs, "
                                  "e.g. --states a,b --inputs u"
                                : "This method needs two directions of a rotor's motion; the default one takes one"));
  }
  if (angle == "vibration") return;
  for (const Channel& c : like.channels) {
    if (like.has("beta") || c.quantity != Quantity::angle) continue;
    throw Error(
        fmt::format("{}: no column 'beta', but '{}' is an angle; if it is the rotor's, name the columns: --columns{}",
                    like.source, c.name, columns_with_beta(record.columns, like, c.name)));
  }
  if (!like.has("beta")) {
    throw Error(fmt::format(
        "{}: no column 'beta' (with its unit); present: {}. The force of the unbalance turns with the rotor, and the "
        "motion lags it by an angle that changes through the critical speed, so that the motion alone does not tell "
        "it: give the angle (beta_rad, beta_deg), a tacho (--pulses CHANNEL) or the speed (speed_rpm), an assumed "
        "speed profile as beta with --angle profile, or with --angle vibration let a steady run-up or run-down tell "
        "its own speed",
        like.source, present));
  }
}

regression::SolveOptions IdentifyFlags::solver(const regression::SolveOptions& defaults) const {
  regression::SolveOptions s = solve;
  s.method = regressor.empty() ? defaults.method : regressor;
  for (const auto& [name, value] : kSelections) {
    if (name == selection) s.selection = value;
  }
  if (regressor.empty() && selection == "automatic") s.selection = defaults.selection;
  return s;
}

identification::IdentifyOptions IdentifyFlags::options(const Recording& like) const {
  identification::IdentifyOptions o;
  o.method = method_chosen();
  o.rotor = weak();
  o.paper = paper();
  o.consistent = consistent();
  o.second_order = second_order();
  o.drive.rotor = o.rotor;
  o.drive.drive = drive;
  o.drive.inertia = inertia;
  o.drive.mass = mass;
  o.second_order.output = output;
  o.second_order.input = input;
  if (o.method == identification::Method::sindy) {
    o.sindy = sindy(like);
    if (!library.empty()) o.library = candidate_library(like);
    for (const std::string& text : bounds) o.bounds.linear.push_back(identification::linear_bound(text));
    if (least_decay >= 0) o.bounds.least_decay = least_decay;
    o.bounds.trapping = trapping;
  }
  o.holdout = no_holdout ? 0 : holdout;
  return o;
}

identification::RotorIdentifyOptions IdentifyFlags::weak() const {
  identification::RotorIdentifyOptions o;
  if (angle == "profile") o.angle_source = identification::AngleSource::profile;
  if (angle == "vibration") o.angle_source = identification::AngleSource::vibration;
  if (!modes.empty()) o.modal = io::load<ModalModel>(modes);
  return o;
}

identification::PaperOptions IdentifyFlags::paper() const {
  identification::PaperOptions o;
  o.solver = solver(o.solver);
  if (filter_ms > 0) o.filter_sd = filter_ms * 1e-3;
  if (!modes.empty()) {
    for (const Mode& mode : io::load<ModalModel>(modes).modes) o.poles.push_back(mode.pole);
  }
  o.library = expr::split_terms(term_list);
  if (compare && method != "paper") {  // the chain as printed is compared only when asked for
    o.filter = identification::PaperFilter::equation;
    if (filter_ms == 0) o.filter_sd = 10e-3;
  }
  return o;
}

identification::ConsistentOptions IdentifyFlags::consistent() const {
  identification::ConsistentOptions o;
  if (filter_ms > 0) o.filter_sd = filter_ms * 1e-3;
  return o;
}

identification::SecondOrderOptions IdentifyFlags::second_order() const {
  identification::SecondOrderOptions o;
  o.solver = solver(o.solver);
  o.library = expr::split_terms(term_list);
  o.filter_sd = filter_ms * 1e-3;
  o.refine = !no_refine;
  return o;
}

identification::SindyOptions IdentifyFlags::sindy(const Recording& like) const {
  identification::SindyOptions o;
  o.states = states;
  o.inputs = inputs;
  o.order = order == 2 ? 2 : 1;
  o.discrete = discrete;
  o.search.window = window;
  o.search.t_value = term_t_value;
  o.search.max_passes = max_passes;
  o.refine = !no_refine;
  o.solver = solver(o.solver);
  if (o.states.empty()) {
    for (const Channel& c : like.channels) {
      if (std::find(inputs.begin(), inputs.end(), c.name) == inputs.end()) o.states.push_back(c.name);
    }
  }
  for (const std::string& text : holds) {
    for (const auto& [name, value] : by_input(text, inputs)) o.timing.hold[name] = hold_of(value);
  }
  for (const std::string& text : dead_times) {
    for (const auto& [name, value] : by_input(text, inputs)) o.timing.dead_time[name] = seconds_of(value);
  }
  o.timing.find = !no_timing;
  o.hidden = hidden;
  o.equations.denominators = expr::split_terms(denominators);
  for (const std::string& text : known) o.equations.known.push_back(identification::known_equation(text));
  for (const std::string& text : signs) o.equations.signs.push_back(identification::sign_bound(text));
  if (library.empty()) o.library = library_terms(o, {degree, fourier, time, trapping, expr::split_terms(term_list)});
  return o;
}

}  // namespace whirl::app
