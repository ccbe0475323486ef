#include "whirl/modal/checks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/modal/poles.hpp"

namespace whirl::modal {

ModeComplexity mode_complexity(const Eigen::Ref<const Eigen::VectorXcd>& shape) {
  const double xx = shape.real().squaredNorm(), yy = shape.imag().squaredNorm(), xy = shape.real().dot(shape.imag());
  ModeComplexity result;
  if (shape.size() < 2 || !(xx + yy > 0)) return result;
  const double root = std::hypot(xx - yy, 2 * xy);
  result.mpc = std::pow(root / (xx + yy), 2);
  // Direction of the line of best fit through the origin.
  const double angle = 0.5 * std::atan2(2 * xy, xx - yy);
  double sum = 0;
  for (const std::complex<double> v : shape) {
    const double off = std::abs(std::arg(v * std::polar(1.0, -angle)));
    sum += std::abs(v) * std::min(off, std::acos(-1.0) - off);
  }
  result.mpd = sum / shape.cwiseAbs().sum();
  return result;
}

ModeShapes mode_shapes(const ModalModel& model) {
  ModeShapes shapes;
  if (model.references.empty()) return shapes;
  const auto at = [&](const std::vector<std::string>& fixed, const std::vector<std::string>& moving) {
    std::vector<Eigen::Index> rows;
    for (std::size_t c = 0; c < fixed.size(); ++c) {
      if (fixed[c] == fixed.front() &&
          std::find(shapes.points.begin(), shapes.points.end(), moving[c]) == shapes.points.end()) {
        rows.push_back(static_cast<Eigen::Index>(c));
        shapes.points.push_back(moving[c]);
      }
    }
    return rows;
  };
  std::vector<Eigen::Index> rows = at(model.references, model.responses);
  if (rows.size() < 2) {
    shapes.points.clear();
    rows = at(model.responses, model.references);
  }
  shapes.value.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(model.modes.size()));
  for (Eigen::Index r = 0; r < shapes.value.rows(); ++r) {
    for (Eigen::Index k = 0; k < shapes.value.cols(); ++k) {
      shapes.value(r, k) = model.modes[static_cast<std::size_t>(k)].residues[rows[static_cast<std::size_t>(r)]];
    }
  }
  return shapes;
}

std::vector<ModeMatch> match_modes(const ModalModel& first, const ModalModel& second) {
  const ModeShapes a = mode_shapes(first), b = mode_shapes(second);
  if (a.points.empty() || a.points != b.points) {
    throw Error(
        fmt::format("modes over {} cannot be compared with modes over {}: must be the same points in the same order",
                    a.points.empty() ? "unnamed points" : fmt::format("{}", fmt::join(a.points, ", ")),
                    b.points.empty() ? "unnamed points" : fmt::format("{}", fmt::join(b.points, ", "))));
  }
  std::vector<ModeMatch> matches;
  for (std::size_t i = 0; i < first.modes.size(); ++i) {
    ModeMatch best;
    double score = -1;
    for (std::size_t k = 0; k < second.modes.size(); ++k) {
      const double change = second.modes[k].frequency.value / first.modes[i].frequency.value - 1;
      if (std::abs(change) > 0.2) continue;
      const double alike = mac(a.value.col(static_cast<Eigen::Index>(i)), b.value.col(static_cast<Eigen::Index>(k)));
      if (alike - std::abs(change) > score) {
        score = alike - std::abs(change);
        best = {i, k, change, alike};
      }
    }
    if (score > -1) matches.push_back(best);
  }
  return matches;
}

std::vector<Reciprocity> check_reciprocity(const FrequencyResponse& frf) {
  std::vector<Reciprocity> found;
  for (std::size_t a = 0; a < frf.channels.size(); ++a) {
    for (std::size_t b = a + 1; b < frf.channels.size(); ++b) {
      const FrfChannel &first = frf.channels[a], &second = frf.channels[b];
      if (first.response != second.reference || first.reference != second.response || first.response == first.reference)
        continue;
      const double mean = (first.value + second.value).norm() / 2;
      if (!(mean > 0)) continue;
      const bool stated = first.variance.size() == first.value.size() && second.variance.size() == second.value.size();
      // A variance is that of the magnitude: half of the complex one.
      const double noise = stated ? std::sqrt(2 * (first.variance.sum() + second.variance.sum())) : 0;
      found.push_back({first.response, first.reference, (first.value - second.value).norm() / mean, noise / mean});
    }
  }
  return found;
}

std::vector<DrivePoint> check_drive_points(const ModalModel& model) {
  std::vector<DrivePoint> found;
  for (std::size_t c = 0; c < model.responses.size(); ++c) {
    if (model.responses[c] != model.references[c]) continue;
    DrivePoint point{model.responses[c], {}};
    for (std::size_t k = 0; k < model.modes.size(); ++k) {
      if (model.modes[k].residues[static_cast<Eigen::Index>(c)].imag() > 0) point.wrong_modes.push_back(k);
    }
    found.push_back(std::move(point));
  }
  return found;
}

void warn_of_contradictions(const FrequencyResponse& frf, ModalModel& model) {
  for (std::string& text : contradicting_channels(model)) model.summary.warn(std::move(text));
  for (const Reciprocity& pair : check_reciprocity(frf)) {
    if (pair.difference > std::max(0.1, 3 * pair.noise)) {
      model.summary.warn(fmt::format("{} to {} differs from {} to {} by {:.0f} %: reciprocity does not hold",
                                     pair.first, pair.second, pair.second, pair.first, 100 * pair.difference));
    }
  }
  for (const DrivePoint& point : check_drive_points(model)) {
    if (!point.wrong_modes.empty()) {
      model.summary.warn(
          fmt::format("{} is hit and measured, but {} of its residues have the wrong sign: is the sensor turned round?",
                      point.point, point.wrong_modes.size()));
    }
  }
}

}  // namespace whirl::modal
