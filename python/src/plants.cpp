#include <fmt/format.h>

#include "bindings.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/pages/compare_report.hpp"
#include "whirl/pages/margins_report.hpp"
#include "whirl/pages/monte_carlo_report.hpp"
#include "whirl/tuning/compare.hpp"
#include "whirl/tuning/design.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::python {
namespace {

using rig::RigParameters;

/// What a design may know beside the model: the arguments that `design`, `margins`, `compare` and `robustness` share.
struct Plant {
  std::optional<double> mass_kg;
  const StiffnessLaw* stiffness = nullptr;
  const ModalModel* modes = nullptr;
  const RigParameters* data_sheets = nullptr;

  tuning::DesignOptions options(const IdentifiedModel& model) const {
    tuning::DesignOptions options;
    options.hardware = tuning::data_sheet(data_sheets != nullptr ? *data_sheets : RigParameters{});
    if (!model.rotor) throw Error("the model has no rotor parameters: identify with method='weak'");
    if (stiffness != nullptr) {
      options.gain = model.rotor->k1 / stiffness->k1.value;
    } else if (mass_kg) {
      require_range("mass_kg", *mass_kg, 1e-9, 1e9, "kg");
      options.gain = 1 / *mass_kg;
    } else if (model.rotor->gain == 0) {
      throw Error("the rotor's mass is needed: give mass_kg or stiffness");
    }
    if (modes != nullptr) options.hardware.modes = tuning::structure_modes(*modes, model.rotor->natural_frequency());
    return options;
  }
};

ControllerDesign design_controller(const IdentifiedModel& model, const Plant& plant, const std::string& law,
                                   const std::string& estimator, bool feedforward, std::map<std::string, double> fixed,
                                   int evaluations, std::uint64_t seed, const std::function<void(double)>& progress) {
  tuning::DesignOptions options = plant.options(model);
  options.law = law;
  options.estimator = estimator;
  options.feedforward = feedforward;
  options.fixed = std::move(fixed);
  options.evaluations = evaluations;
  options.seed = seed;
  options.progress.tuning = [&](const tuning::DesignProgress& p) {
    stop_when_interrupted();
    if (!progress) return;
    const py::gil_scoped_acquire lock;
    progress(std::min(1.0, static_cast<double>(p.evaluation) / static_cast<double>(p.budget)));
  };
  const py::gil_scoped_release unlocked;
  return tuning::design(model, options);
}

py::tuple margins(const ControllerDesign& controller, const IdentifiedModel& model, const Plant& plant, int speeds,
                  std::uint64_t seed, int threads) {
  const tuning::DesignOptions design = plant.options(model);
  tuning::MarginOptions options;
  options.speeds = speeds;
  options.seed = seed;
  options.threads = threads;
  std::vector<tuning::MarginStudy> studies;
  std::optional<tuning::DeliveredDelay> delivered;
  {
    const py::gil_scoped_release unlocked;
    studies = tuning::margin_studies(controller, model, design, options);
    delivered = tuning::delivered_delay(controller, studies, model, design);
  }
  Summary summary;
  tuning::state_parts(identification::Consumer::margins, model, design.hardware, summary);
  for (const tuning::MarginStudy& s : studies) {
    std::optional<Finding> missed = tuning::margin_failure(s.speeds, controller);
    if (!missed) continue;
    if (!s.plant.empty()) missed->where = "with " + s.plant + ", " + missed->where;
    summary.add(*missed);
  }
  io::Json json = pages::to_json(studies);
  if (delivered) json.set("delivered", pages::to_json(*delivered));
  return py::make_tuple(as_python(json), summary);
}

py::tuple compare(const IdentifiedModel& model, const Plant& plant, RigParameters rig,
                  const std::vector<std::string>& laws, const IdentifiedModel* balanced, int evaluations, int seeds,
                  std::uint64_t seed, int threads, bool matrix) {
  require_range("seeds", seeds, 1, 1000);
  tuning::CompareOptions options;
  options.design = plant.options(model);
  options.design.evaluations = evaluations;
  options.design.seed = seed;
  options.design.threads = threads;
  options.matrix = matrix;
  if (!laws.empty()) options.methods.clear();
  for (const std::string& law : laws) options.methods.push_back(tuning::parse_method(law));
  options.seeds.clear();
  for (int i = 0; i < seeds; ++i) options.seeds.push_back(100 + seed + static_cast<std::uint64_t>(i));
  if (balanced != nullptr && balanced->rotor) options.balanced_eps = balanced->rotor->eps;
  pages::Comparison found;
  {
    const py::gil_scoped_release unlocked;
    found.results = tuning::compare(model, rig, options);
    found.floor = tuning::physical_floor(tuning::best_result(found.results).design, rig, options.balanced_eps,
                                         options.seeds.front());
  }
  found.rig = std::move(rig);
  found.provenance = io::provenance({}, "Python", seed);
  const tuning::ComparedResult& best = tuning::best_result(found.results);
  Summary summary;
  tuning::state_parts(identification::Consumer::compare, model, options.design.hardware, summary);
  if (!best.nominal.stable)
    summary.fail(fmt::format("no method passes on this rig; {}: {}", best.label, best.nominal.verdict.text()));
  py::dict controllers;
  for (const tuning::ComparedResult& r : found.results) controllers[py::str(r.label)] = r.design;
  return py::make_tuple(as_python(to_json(found)), summary, controllers);
}

py::tuple robustness(const ControllerDesign& controller, IdentifiedModel model, const Plant& plant, int samples,
                     double limit_mm, std::uint64_t seed, int threads, const std::function<void(double)>& progress) {
  const tuning::DesignOptions design = plant.options(model);
  if (design.gain > 0) model.rotor->gain = design.gain;
  require_range("limit_mm", limit_mm, 0, 1000, "mm");
  tuning::MonteCarloOptions options;
  options.samples = samples;
  options.limit = 1e-3 * limit_mm;
  options.seed = seed;
  options.threads = threads;
  options.progress = [&](long done, long all) {
    stop_when_interrupted();
    if (!progress) return;
    const py::gil_scoped_acquire lock;
    progress(static_cast<double>(done) / static_cast<double>(all));
  };
  tuning::MonteCarloResult result;
  {
    const py::gil_scoped_release unlocked;
    result = tuning::monte_carlo(controller, model, design.hardware, options);
  }
  Summary summary;
  tuning::state_parts(identification::Consumer::robustness, model, design.hardware, summary);
  if (const std::string low = tuning::margin_shortfall(controller); !low.empty())
    summary.fail("the margins of the design: " + low);
  if (result.stable.high < tuning::kEnoughPass) {
    summary.fail(
        fmt::format("{:.1f} % of the machines fail the acceptance limits, at least {:.1f} % with 95 % confidence",
                    100 * (1 - result.stable.value), 100 * (1 - result.stable.high)));
  }
  return py::make_tuple(as_python(pages::to_json(result, options)), summary);
}

/// Defines a function of a model and of what else is known of its plant; `rest`: its further arguments.
template <class Call, class... Rest>
void define(py::module_& m, const char* name, Call call, const Rest&... rest) {
  m.def(name, call, py::arg("model"), py::arg("mass_kg") = py::none(), py::arg("stiffness") = py::none(),
        py::arg("modes") = py::none(), py::arg("data_sheets") = py::none(), py::kw_only(), rest...);
}

using Mass = std::optional<double>;
using Stiffness = const StiffnessLaw*;
using Modes = const ModalModel*;
using Sheets = const RigParameters*;
using Model = const IdentifiedModel&;

}  // namespace

void bind_plants(py::module_& m) {
  define(
      m, "_design",
      [](Model model, Mass mass, Stiffness stiffness, Modes modes, Sheets sheets, const std::string& law,
         const std::string& estimator, bool feedforward, std::map<std::string, double> fixed, int evaluations,
         std::uint64_t seed, const std::function<void(double)>& progress) {
        return design_controller(model, {mass, stiffness, modes, sheets}, law, estimator, feedforward, std::move(fixed),
                                 evaluations, seed, progress);
      },
      py::arg("law"), py::arg("estimator"), py::arg("feedforward"), py::arg("fixed"), py::arg("evaluations"),
      py::arg("seed"), py::arg("progress"));
  define(
      m, "_margins",
      [](Model model, Mass mass, Stiffness stiffness, Modes modes, Sheets sheets, const ControllerDesign& controller,
         int speeds, std::uint64_t seed, int threads) {
        return margins(controller, model, {mass, stiffness, modes, sheets}, speeds, seed, threads);
      },
      py::arg("controller"), py::arg("speeds"), py::arg("seed"), py::arg("threads"));
  define(
      m, "_compare",
      [](Model model, Mass mass, Stiffness stiffness, Modes modes, Sheets sheets, const RigParameters& rig,
         const std::vector<std::string>& laws, const IdentifiedModel* balanced, int evaluations, int seeds,
         std::uint64_t seed, int threads, bool matrix) {
        return compare(model, {mass, stiffness, modes, sheets}, rig, laws, balanced, evaluations, seeds, seed, threads,
                       matrix);
      },
      py::arg("rig") = RigParameters{}, py::arg("laws"), py::arg("balanced"), py::arg("evaluations"), py::arg("seeds"),
      py::arg("seed"), py::arg("threads"), py::arg("matrix"));
  define(
      m, "_robustness",
      [](Model model, Mass mass, Stiffness stiffness, Modes modes, Sheets sheets, const ControllerDesign& controller,
         int samples, double limit_mm, std::uint64_t seed, int threads, const std::function<void(double)>& progress) {
        return robustness(controller, model, {mass, stiffness, modes, sheets}, samples, limit_mm, seed, threads,
                          progress);
      },
      py::arg("controller"), py::arg("samples"), py::arg("limit_mm"), py::arg("seed"), py::arg("threads"),
      py::arg("progress"));
}

}  // namespace whirl::python
