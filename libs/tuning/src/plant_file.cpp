#include "whirl/tuning/plant_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/json.hpp"
#include "whirl/rig/from_modal.hpp"

namespace whirl::tuning {
namespace {

using Complex = std::complex<double>;

struct Pole {
  Complex pole, residue;
};

Eigen::MatrixXd read_square(const io::JsonReader& in) {
  const auto rows = in.items();
  const auto n = static_cast<Eigen::Index>(rows.size());
  if (n < 2 || n > 400) throw in.error(fmt::format("{} rows: must be 2 to 400", n));
  Eigen::MatrixXd m(n, n);
  for (Eigen::Index r = 0; r < n; ++r) {
    const Eigen::VectorXd row = rows[static_cast<std::size_t>(r)].vector();
    if (row.size() != n) {
      throw rows[static_cast<std::size_t>(r)].error(fmt::format("{} numbers: the matrix is square, {}", row.size(), n));
    }
    m.row(r) = row;
  }
  return m;
}

/// A column or a row of n numbers, flat or as a matrix of one column or one row.
Eigen::VectorXd read_line(const io::Json& document, const io::JsonReader& in, const char* key, Eigen::Index n) {
  const io::JsonReader line = in.at(key);
  const auto* array = document.find(key)->get<io::Json::Array>();
  const bool nested = array != nullptr && !array->empty() && array->front().get<io::Json::Array>() != nullptr;
  std::vector<double> all;
  if (nested) {
    for (const io::JsonReader& item : line.items()) {
      const std::vector<double> part = item.numbers();
      all.insert(all.end(), part.begin(), part.end());
    }
  } else {
    all = line.numbers();
  }
  if (static_cast<Eigen::Index>(all.size()) != n) {
    throw line.error(fmt::format("{} numbers: must be {}, one force and one displacement", all.size(), n));
  }
  Eigen::VectorXd out(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    out[i] = all[static_cast<std::size_t>(i)];
    if (!std::isfinite(out[i])) throw line.error("must be finite numbers");
  }
  return out;
}

std::vector<Pole> of_matrices(const io::Json& document, const io::JsonReader& in) {
  const Eigen::MatrixXd a = read_square(in.at("A"));
  const Eigen::VectorXd b = read_line(document, in, "B", a.rows()), c = read_line(document, in, "C", a.rows());
  if (in.has("D") && read_line(document, in, "D", 1)[0] != 0) {
    throw in.at("D").error("must be 0: a force moves no mass at once");
  }
  const Eigen::ComplexEigenSolver<Eigen::MatrixXcd> solver(Eigen::MatrixXcd(a.cast<Complex>()));
  if (solver.info() != Eigen::Success) throw in.at("A").error("its eigenvalues were not found");
  const Eigen::MatrixXcd vectors = solver.eigenvectors();
  const Eigen::PartialPivLU<Eigen::MatrixXcd> left(vectors);
  const Eigen::VectorXcd force = b.cast<Complex>(), sensor = c.cast<Complex>(), roots = solver.eigenvalues();
  const Eigen::VectorXcd drive = left.solve(force), seen = vectors.transpose() * sensor;
  // The modes must give the response back: they do not where poles repeat without as many eigenvectors.
  const Complex s{0, 1.1 * roots.cwiseAbs().mean()};
  const Eigen::MatrixXcd resolvent = s * Eigen::MatrixXcd::Identity(a.rows(), a.cols()) - a.cast<Complex>();
  const Eigen::VectorXcd state = Eigen::PartialPivLU<Eigen::MatrixXcd>(resolvent).solve(force);
  const Complex direct = (sensor.transpose() * state)(0);
  Complex sum = 0;
  double size = 0, weight = 0;
  std::vector<Pole> out;
  for (Eigen::Index i = 0; i < roots.size(); ++i) {
    const Complex residue = seen[i] * drive[i];
    sum += residue / (s - roots[i]);
    size += std::abs(residue / (s - roots[i]));
    weight = std::max(weight, std::abs(residue / roots[i]));
    out.push_back({roots[i], residue});
  }
  if (!(std::abs(sum - direct) <= 1e-6 * size)) {
    throw in.at("A").error("poles repeat without as many eigenvectors: not a sum of modes");
  }
  // What the force does not reach or the sensor does not see has no part.
  std::erase_if(out, [&](const Pole& p) { return !(std::abs(p.residue / p.pole) > 1e-9 * weight); });
  for (const Pole& p : out) {
    if (std::abs(p.pole.imag()) <= 1e-9 * std::abs(p.pole)) {
      throw in.at("A").error(fmt::format(
          "a real pole at {:.4g} 1/s: only modes that ring can be taken; a lag of the actuator belongs to --hardware",
          p.pole.real()));
    }
  }
  std::erase_if(out, [](const Pole& p) { return p.pole.imag() < 0; });
  return out;
}

std::vector<Pole> of_poles(const io::JsonReader& in) {
  const auto poles = in.at("poles").items(), residues = in.at("residues").items();
  if (poles.empty() || poles.size() > 200) throw in.at("poles").error("must be 1 to 200 poles");
  if (poles.size() != residues.size()) {
    throw in.at("residues").error(fmt::format("{} residues for {} poles", residues.size(), poles.size()));
  }
  std::vector<Pole> out;
  for (std::size_t i = 0; i < poles.size(); ++i) {
    const Pole p{poles[i].complex(), residues[i].complex()};
    if (!(p.pole.imag() > 0)) {
      throw poles[i].error("imaginary part must be above 0: one pole of each conjugate pair");
    }
    out.push_back(p);
  }
  return out;
}

/// A key that nobody reads would be a number that changes nothing.
void require_keys(const io::JsonReader& in, bool matrices) {
  for (const auto& [key, value] : in.members()) {
    const bool free = key == "schema" || key == "comment" || key == "provenance" || key == "eccentricity_m" ||
                      key == "eccentricity_phase_rad";
    const bool form =
        matrices ? key == "A" || key == "B" || key == "C" || key == "D" : key == "poles" || key == "residues";
    if (free || form) continue;
    throw in.error(fmt::format("key '{}': must be {}, eccentricity_m, eccentricity_phase_rad or comment", key,
                               matrices ? "A, B, C, D" : "poles, residues"));
  }
}

/// One pole for those that coincide: their residues add up.
std::vector<Pole> merged(const std::vector<Pole>& poles) {
  std::vector<Pole> out;
  for (const Pole& p : poles) {
    const auto same =
        std::ranges::find_if(out, [&](const Pole& o) { return std::abs(o.pole - p.pole) < 1e-9 * std::abs(p.pole); });
    if (same == out.end()) {
      out.push_back(p);
    } else {
      same->residue += p.residue;
    }
  }
  return out;
}

ModalModel modal_of(const std::vector<Pole>& poles, const io::JsonReader& in) {
  ModalModel modal;
  for (const Pole& p : poles) {
    const std::string name = fmt::format("the mode at {:.4g} Hz", std::abs(p.pole) / (2 * std::numbers::pi));
    if (!(p.pole.real() < 0)) {
      throw in.error(fmt::format("{} is not stable: real part {:.4g} 1/s", name, p.pole.real()));
    }
    if (!(std::abs(p.residue) > 0)) throw in.error(name + ": residue 0; the force moves nothing that the sensor sees");
    if (!(std::abs(p.residue.real()) <= 0.05 * std::abs(p.residue.imag()))) {
      throw in.error(fmt::format("{}: residue {:.3g}{:+.3g}i; that of a displacement by a force is imaginary", name,
                                 p.residue.real(), p.residue.imag()));
    }
    Mode mode;
    mode.pole = p.pole;
    mode.frequency.value = std::abs(p.pole) / (2 * std::numbers::pi);
    mode.damping.value = -p.pole.real() / std::abs(p.pole);
    mode.residues = Eigen::VectorXcd::Constant(1, p.residue);
    modal.modes.push_back(mode);
  }
  return modal;
}

}  // namespace

bool is_plant(const io::Json& document) {
  const io::Json* schema = document.find("schema");
  const auto* text = schema != nullptr ? schema->get<std::string>() : nullptr;
  return text != nullptr && text->starts_with("whirl.plant/");
}

LinearPlant read_plant(const io::Json& document, const std::filesystem::path& file) {
  const io::JsonReader in(document, file.string());
  in.require_schema("whirl.plant", 1);
  if (in.has("A") == in.has("poles")) throw in.error("must have either A, B, C or poles and residues");
  require_keys(in, in.has("A"));
  const std::vector<Pole> poles = in.has("A") ? of_matrices(document, in) : merged(of_poles(in));
  if (poles.empty()) throw in.error("the force moves nothing that the sensor sees");
  const io::JsonReader size = in.at("eccentricity_m");
  const double eccentricity = size.number();
  if (!(eccentricity > 0 && eccentricity < 0.1)) throw size.error("must be above 0 and below 0.1 m");

  rig::RigParameters base;
  base.rotor.cubic = base.rotor.stiffness_split = base.rotor.damping_split = base.rotor.cross_stiffness = 0;
  base.rotor.added_mass = 0;
  base.rotor.residual_eccentricity = eccentricity;
  if (in.has("eccentricity_phase_rad")) {
    const io::JsonReader phase = in.at("eccentricity_phase_rad");
    base.rotor.residual_phase = phase.number();
    if (!(std::abs(base.rotor.residual_phase) <= 2 * std::numbers::pi)) {
      throw phase.error(fmt::format("{:g}: must be between -2 pi and 2 pi rad", base.rotor.residual_phase));
    }
  } else {
    base.rotor.residual_phase = 0;
  }
  try {
    const rig::RigParameters p = rig::rig_from_modal(modal_of(poles, in), 0, base);
    LinearPlant out{p.true_model(), p.modes};
    out.rotor.modes.clear();
    return out;
  } catch (const Error& e) {
    if (std::string(e.what()).starts_with(file.string())) throw;
    throw in.error(e.what());
  }
}

}  // namespace whirl::tuning
