#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "whirl/core/error.hpp"
#include "whirl/modal/checks.hpp"
#include "whirl/modal/residues.hpp"
#include "whirl/pages/text/modes.hpp"
#include "whirl/report/rotor_figures.hpp"

namespace whirl::pages {
namespace {

report::Figure shapes_in_band(const std::string& file, const ModalModel& modes) {
  const modal::ModeShapes shapes = modal::mode_shapes(modes);
  if (shapes.points.size() < 2) throw Error(file + ": shapes need two or more points that were measured or hit");
  // What stands outside the band is there for its tail only.
  std::vector<Mode> inside;
  Eigen::MatrixXcd value(shapes.value.rows(), shapes.value.cols());
  for (std::size_t k = 0; k < modes.modes.size(); ++k) {
    const double f = modes.modes[k].frequency.value;
    if (f < modes.band_low || f > modes.band_high) continue;
    value.col(static_cast<Eigen::Index>(inside.size())) = shapes.value.col(static_cast<Eigen::Index>(k));
    inside.push_back(modes.modes[k]);
  }
  value.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(inside.size()));
  if (inside.empty()) throw Error(file + ": no mode in the band whose shape could be drawn");
  return report::mode_shapes(shapes.points, value, inside);
}

}  // namespace

report::Figure modes_figure(const std::string& file, const FrequencyResponse& frf, const ModalModel& modes,
                            const modal::PoleOptions& options) {
  const std::string name = std::filesystem::path(file).filename().string();
  if (name.find("shape") != std::string::npos) return shapes_in_band(file, modes);
  if (name.find("frf") != std::string::npos) {
    return report::frequency_response(frf, 0, modal::synthesise(modes, 0, frf.frequency, frf.kind, frf.window_decay),
                                      modes.modes);
  }
  std::vector<report::OrderPole> poles;
  for (const modal::StabilisationPole& p : modal::stabilisation_diagram(frf, options).poles)
    poles.push_back({p.order, p.frequency(), p.stable()});
  std::vector<double> chosen;
  for (const Mode& mode : modes.modes) chosen.push_back(mode.frequency.value);
  return report::stabilisation(frf, poles, chosen);
}

report::Figure shapes_figure(const modal::OperationalModes& found) {
  Eigen::MatrixXcd shapes(static_cast<Eigen::Index>(found.channels.size()),
                          static_cast<Eigen::Index>(found.modes.size()));
  std::vector<Mode> modes;
  for (std::size_t i = 0; i < found.modes.size(); ++i) {
    shapes.col(static_cast<Eigen::Index>(i)) = found.modes[i].shape;
    Mode mode;
    mode.frequency = found.modes[i].frequency;
    mode.damping = found.modes[i].damping;
    modes.push_back(std::move(mode));
  }
  return report::mode_shapes(found.channels, shapes, modes);
}

report::Figure singular_values_figure(const modal::AmbientModes& found) {
  std::vector<report::SpectrumCurve> curves;
  for (Eigen::Index c = 0; c < std::min<Eigen::Index>(3, found.singular_values.cols()); ++c) {
    curves.push_back({fmt::format("singular value {}", c + 1), found.frequency.tail(found.frequency.size() - 1),
                      found.singular_values.col(c).tail(found.frequency.size() - 1).cwiseSqrt()});
  }
  std::vector<std::pair<std::string, double>> marks;
  for (const modal::AmbientMode& mode : found.modes)
    marks.emplace_back(fmt::format("{:.4g}", mode.frequency), mode.frequency);
  return report::spectrum(curves, AmplitudeKind::rms, Quantity::displacement, marks);
}

}  // namespace whirl::pages
