#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "command.hpp"
#include "identify_options.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/identify/slow_roll.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/io/record_stream.hpp"
#include "whirl/pages/text/identification.hpp"

namespace whirl::app {
namespace {

bool is_rate(const Channel& c) { return c.quantity == Quantity::velocity || c.quantity == Quantity::acceleration; }

/// Refuses velocity and acceleration where the method reads displacements alone.
void refuse_rates(const Recording& record, std::string_view method) {
  for (const Channel& c : record.channels) {
    if ((c.name != "x" && c.name != "y") || !is_rate(c)) continue;
    throw Error(
        fmt::format("{}: '{}' is {} {}: --method {} takes displacements of the shaft (x_mm, y_um); the default "
                    "one takes {} too",
                    record.source, c.name, c.quantity == Quantity::acceleration ? "an" : "a", to_string(c.quantity),
                    method, to_string(c.quantity)));
  }
}

/// Whether a table without a time has velocities or accelerations.
bool has_rates(RecordOptions reader, const std::string& file) {
  reader.rate = 1;  // Hz: any
  try {
    return std::ranges::any_of(reader.read(file).channels, is_rate);
  } catch (const Error&) {
    return false;
  }
}

/// A file without x and y, whose velocities or accelerations may be them by their names. Names that do not tell are
/// said, and so is what keeps a table of them from being a record at all.
std::optional<Recording> read_rates(const RecordOptions& reader, const std::string& file) {
  Recording all;
  try {
    all = reader.read(file);
  } catch (const Error&) {
    if (has_rates(reader, file)) throw;
    return std::nullopt;
  }
  Recording named = identification::with_motion_names(all);
  if (named.has("x") || named.has("y")) return named;
  const auto rate = std::ranges::find_if(all.channels, is_rate);
  const auto shaft = [](const Channel& c) { return c.quantity == Quantity::displacement; };
  if (rate == all.channels.end() || std::ranges::any_of(all.channels, shaft)) return std::nullopt;
  throw Error(fmt::format(
      "{0}: '{1}' is {2} {3}, and no name says along which direction of a rotor it reads. If it does: --columns "
      "\"{1}:x\" beta (a second direction as y). Without a rotor's angle: `whirl transient {0} --channel {1}` fits the "
      "modes of a run, `whirl oma` takes ambient motion; for any other system name the states (--states)",
      file, rate->name, rate->quantity == Quantity::acceleration ? "an" : "a", to_string(rate->quantity)));
}

/// A record; of a rotor y alone will do for x, and where neither is there, what else it may be is said.
Recording read_for(const IdentifyFlags& flags, RecordOptions reader, const std::string& file) {
  try {
    return reader.read(file);
  } catch (const MissingColumn& e) {
    if (flags.method_chosen() != identification::Method::weak || e.column() != "x") throw;
    const std::string what = e.what();
    reader.required = {"y"};
    try {
      return reader.read(file);
    } catch (const MissingColumn& other) {
      if (other.column() != "y") throw;
      reader.required.clear();
      if (std::optional<Recording> rates = read_rates(reader, file)) return *std::move(rates);
      throw Error(
          what +
          ". Probes of other names: --columns \"Probe 1:x\" \"Probe 2:y\". Any other system than a rotor: name its "
          "states, and its inputs, e.g. --states a,b --inputs u");
    }
  }
}

/// One file of any length, read twice: --holdout is a share of its samples.
identification::Identification stream_identify(const IdentifyFlags& flags, const identification::IdentifyOptions& o) {
  if (flags.files.size() != 1) throw Error("--stream takes one file");
  if (!flags.library.empty() || flags.compare) throw Error("--stream takes neither --library nor --compare");
  if (!flags.record.rows.empty()) throw Error("--rows and --stream exclude each other");
  if (flags.record.tacho_stated())
    throw Error("--pulses and --stream exclude each other: `whirl convert` gives the angle");
  if (!flags.record.late.empty()) throw Error("--late and --stream exclude each other");
  RecordOptions reader = flags.record;
  reader.required = flags.required();
  const std::string& file = flags.files.front();
  const auto open = [&]() -> identification::NextPart {
    const std::shared_ptr<io::RecordStream> stream = io::open_record_stream(file, reader.csv());
    return [stream](Recording& part) { return stream->next(part); };
  };
  return identify_stream(
      open, file, [&](const Recording& first) { return flags.sindy(first); }, o);
}

void print_comparison(const identification::MethodComparison& comparison, const IdentifyFlags& flags,
                      const Provenance& provenance, Session& session) {
  io::Json document = to_json(comparison);
  document.set("provenance", to_json(provenance));
  if (!flags.out.empty()) io::save_json(flags.out, document);
  session.say(report::to_text(pages::comparison_table(comparison)));
  session.result(document);
  session.finish(comparison.summary);
}

void run_identify(const IdentifyFlags& flags, Session& session) {
  flags.check(session.command->given_flags());
  if (!flags.out.empty()) session.check_output(flags.out, flags.compare ? "whirl.method_comparison" : "whirl.model");
  const auto options = [&](const Recording& like) {
    identification::IdentifyOptions o = flags.options(like);
    o.progress = [&session](const std::string& what, double share) { session.progress(what, share); };
    return o;
  };
  const auto provenance = [&] {
    return io::provenance({flags.files.begin(), flags.files.end()}, session.command_line);
  };
  identification::Identification id;
  if (flags.stream) {
    id = stream_identify(flags, options({}));
  } else {
    RecordOptions reader = flags.record;
    reader.required = flags.required();
    reader.gaps = true;
    std::vector<Recording> records;
    const auto read = [&](const std::string& file) {
      const Recording record = flags.with_angle(read_for(flags, reader, file));
      const identification::Method method = flags.method_chosen();
      if (flags.of_a_rotor() && method != identification::Method::weak) refuse_rates(record, to_string(method));
      flags.require_rotor_channels(record);
      return record;
    };
    for (const std::string& file : flags.files) records.push_back(read(file));
    const identification::IdentifyOptions o = options(records.front());
    if (flags.compare) {
      return print_comparison(identification::compare_methods(records, o), flags, provenance(), session);
    }
    id = flags.slow_roll.empty()
             ? identification::identify(records, o)
             : identification::identify_with_slow_roll(records, read(flags.slow_roll), o,
                                                       identification::slow_roll_meaning(flags.slow_roll_reads));
  }
  session.progress("identify", 1);
  id.model.provenance = provenance();
  const io::Json document = to_json(id);
  if (!flags.out.empty()) io::save_json(flags.out, document);
  session.say(pages::to_text(id.model));
  if (id.usable()) session.say(pages::to_text(id.evidence, id.summary, id.model.ambiguities));
  session.result(document);
  session.finish(id.summary);
}

}  // namespace

void add_identify(CommandLine& app, Session& session) {
  auto o = std::make_shared<IdentifyFlags>();
  CommandLine* sub = add_command(
      app, session, "identify", "Equations of motion from records of a rotor or of any system (SINDy)",
      "Rotor: CSV records of a run-up or run-down with t_s (or --rate), x_mm, y_mm (any length unit), beta_rad: "
      "displacement\n"
      "of the disk centre and rotor angle; of x and y one will do (a rotor whose axes are alike). Velocity or "
      "acceleration\n"
      "(vx_mm_s, ax_g, ay_m_s2) is taken as it is: the model's own velocity or acceleration, through the high-pass of "
      "the sensor,\n"
      "is fitted to it; nothing is integrated but for the first guess. Several records "
      "share the rotor; each has its own unbalance.\n"
      "Any other system: CSV records with one column name_unit per signal; several files are several trajectories.\n"
      "Methods: weak (default): tied second-order weak form with order-tracked test functions, generalised least "
      "squares,\n"
      "then output-error refinement; terms are added on evidence only. paper: Gaussian filter, 4th-order differences "
      "twice,\n"
      "library of eq. 24, LASSO with cross-validation. consistent: same filter on every column, five tied parameters.\n"
      "second-order: y'' = f(y, y', u) of one degree of freedom from channels --output-channel and --input-channel. "
      "sindy: any number "
      "of\n"
      "states and inputs, weak form then refinement on free runs, one setting for clean and noisy records; with "
      "--library the\n"
      "terms, ties and known parts of library.toml (written by hand or by whirl derive).\n"
      "Output: equations with 95 % intervals (rotor: k1 1/s^2, k2 1/(m^2 s^2), c 1/s, e m, e_phase rad), chi^2, "
      "condition\n"
      "number, terms that cannot be distinguished, free-run error on a part that was held out, and a sentence on what "
      "the "
      "model\n"
      "may be trusted for.\n\n"
      "Example: whirl identify rundown.csv --out model.json\n"
      "         whirl identify a.csv b.csv --method sindy --states x,v --inputs u --degree 3\n"
      "         whirl identify a.csv --states x,v --inputs u --sign \"v':v=-\"   (damping takes energy)\n"
      "         whirl identify a.csv --states x,v --bound \"[v': x] <= 3*[v': v]\" --stable-1s 0   (a linear part that "
      "does not grow)\n"
      "         whirl identify wake.csv --states a1,a2,a3 --trapping   (degree 2, bounded from any start)\n"
      "         whirl identify rundown.csv --library rotor.toml\n"
      "         whirl identify rundown.csv --compare",
      [o, &session] { run_identify(*o, session); });
  o->add_to(sub);
}

}  // namespace whirl::app
