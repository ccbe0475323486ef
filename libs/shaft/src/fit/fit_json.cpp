#include "whirl/shaft/fit/fit_json.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "whirl/core/magnitude.hpp"

namespace whirl::shaft {
namespace {

using io::Json;
constexpr double kHalf = 1.959964;

constexpr std::array kKindNames{
    std::pair{UnknownKind::stiffness, "stiffness"},
    std::pair{UnknownKind::damping, "damping"},
    std::pair{UnknownKind::material_damping, "material_damping"},
    std::pair{UnknownKind::joint_damping, "joint_damping"},
    std::pair{UnknownKind::youngs_modulus, "youngs_modulus"},
    std::pair{UnknownKind::diameter, "diameter"},
    std::pair{UnknownKind::disc_position, "disc_position"},
    std::pair{UnknownKind::disc_mass, "disc_mass"},
    std::pair{UnknownKind::unbalance, "unbalance"},
    std::pair{UnknownKind::bow, "bow"},
    std::pair{UnknownKind::gain, "gain"},
    std::pair{UnknownKind::runout, "runout"},
};

FitRow complex_row(const RotorFit& fit, std::size_t k) {
  const FitUnknown &real = fit.unknowns[k], &imaginary = fit.unknowns[k + 1];
  const auto i = static_cast<Eigen::Index>(k);
  const std::complex<double> v(real.estimate.value, imaginary.estimate.value);
  const double size = std::abs(v), c = size > 0 ? v.real() / size : 1, s = size > 0 ? v.imag() / size : 0;
  const double across = std::sqrt(fit.covariance(i, i) * fit.covariance(i + 1, i + 1));
  const double both = across > 0 ? fit.covariance(i, i + 1) / across * real.estimate.sd * imaginary.estimate.sd : 0;
  const double a = real.estimate.sd * real.estimate.sd, b = imaginary.estimate.sd * imaginary.estimate.sd;
  FitRow row;
  row.name = real.name.substr(0, real.name.rfind(" ("));
  row.kind = real.kind;
  row.unit = real.unit;
  row.complex = true;
  // Near zero the direction is as uncertain as the size: the larger of both components.
  constexpr double kNear = 5;
  const double radial = std::sqrt(std::max(0.0, c * c * a + s * s * b + 2 * c * s * both));
  const double larger = std::max(real.estimate.sd, imaginary.estimate.sd);
  row.value = magnitude_estimate(size, size < kNear * larger ? larger : radial);
  row.angle = std::arg(v);
  row.angle_half = size > 0 ? kHalf * std::sqrt(std::max(0.0, s * s * a + c * c * b - 2 * c * s * both)) / size : M_PI;
  if (row.value.low <= 0) row.angle_half = M_PI;
  row.relative_half_width = std::max(real.relative_half_width, imaginary.relative_half_width);
  row.identifiable = real.identifiable && imaginary.identifiable;
  return row;
}

Json curve(const Eigen::VectorXcd& z, const Eigen::VectorXd& half) {
  return Json::object()
      .set("amplitude", Json(Eigen::VectorXd(z.cwiseAbs())))
      .set("phase", Json(Eigen::VectorXd(z.cwiseArg())))
      .set("half_width", Json(half));
}

}  // namespace

std::string_view to_string(UnknownKind kind) {
  for (const auto& [k, name] : kKindNames)
    if (k == kind) return name;
  return "";
}

std::vector<FitRow> fit_rows(const RotorFit& fit) {
  std::vector<FitRow> rows;
  for (std::size_t k = 0; k < fit.unknowns.size(); ++k) {
    const FitUnknown& u = fit.unknowns[k];
    if (u.kind >= UnknownKind::unbalance) {
      rows.push_back(complex_row(fit, k++));
      continue;
    }
    FitRow row;
    row.name = u.name;
    row.kind = u.kind;
    row.unit = u.unit;
    row.value = u.estimate;
    row.relative_half_width = u.relative_half_width;
    row.identifiable = u.identifiable;
    rows.push_back(row);
  }
  return rows;
}

Json fit_json(const RotorFit& fit, const std::vector<VirtualProbe>& motions, const std::vector<VirtualForce>& forces) {
  Json unknowns = Json::array(), weak = Json::array(), next = Json::array(), stations = Json::array(),
       supports = Json::array();
  for (const FitRow& r : fit_rows(fit)) {
    Json row = Json::object()
                   .set("name", r.name)
                   .set("kind", to_string(r.kind))
                   .set("estimate", io::to_json(r.value, r.unit))
                   .set("relative_half_width", r.relative_half_width)
                   .set("identifiable", r.identifiable);
    if (r.complex) row.set("angle", r.angle).set("angle_half_width", r.angle_half);
    unknowns.push(std::move(row));
  }
  for (const WeakDirection& w : fit.weak) {
    Json shares = Json::array();
    for (const WeakDirection::Share& s : w.shares)
      shares.push(Json::object().set("name", s.name).set("weight", s.weight));
    weak.push(Json::object().set("words", w.words).set("half_width", w.half_width).set("shares", std::move(shares)));
  }
  for (const NextRun& n : fit.next)
    next.push(Json::object()
                  .set("words", n.words)
                  .set("decides", n.decides)
                  .set("half_width", n.half_width)
                  .set("now", n.now));
  for (const VirtualProbe& v : motions)
    stations.push(Json::object()
                      .set("position", v.position)
                      .set("speed", v.speeds)
                      .set("x", curve(v.x, v.x_half))
                      .set("y", curve(v.y, v.y_half)));
  for (const VirtualForce& v : forces)
    supports.push(Json::object()
                      .set("support", v.support)
                      .set("speed", v.speeds)
                      .set("x", curve(v.x, v.x_half))
                      .set("y", curve(v.y, v.y_half)));
  return io::start_document("whirl.rotor_fit", 1)
      .set("summary", io::to_json(fit.summary))
      .set("misfit", Json::object()
                         .set("chi_square", fit.misfit.chi_square)
                         .set("deviations", fit.misfit.deviations)
                         .set("band_deviations", fit.misfit.band_deviations)
                         .set("band_run", fit.misfit.band_run)
                         .set("band_from", fit.misfit.band_from)
                         .set("band_to", fit.misfit.band_to)
                         .set("scatter_ratio", fit.misfit.scatter_ratio)
                         .set("scatter_deviations", fit.misfit.scatter_deviations)
                         .set("explained", fit.misfit.explained))
      .set("unknowns", std::move(unknowns))
      .set("noise", fit.noise)
      .set("weak_directions", std::move(weak))
      .set("next_runs", std::move(next))
      .set("motions", std::move(stations))
      .set("forces", std::move(supports))
      .set("starts", fit.starts)
      .set("iterations", fit.iterations);
}

}  // namespace whirl::shaft
