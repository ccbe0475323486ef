// Frequency responses that contradict the others: the residues of a mode are a product of shape and participation.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "whirl/modal/checks.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;

// The FRFs as a table of responses by references. Only complete tables are judged.
struct Table {
  std::vector<std::string> responses, references;
  std::vector<std::vector<Index>> channel;  // [response][reference]; -1 = not measured
  std::vector<std::string> twice;           // pairs that are there more than once
};

std::size_t index_of(std::vector<std::string>& names, const std::string& name) {
  const auto at = std::find(names.begin(), names.end(), name);
  if (at != names.end()) return static_cast<std::size_t>(at - names.begin());
  names.push_back(name);
  return names.size() - 1;
}

Table table_of(const ModalModel& model) {
  Table t;
  std::map<std::pair<std::size_t, std::size_t>, Index> found;
  for (std::size_t c = 0; c < model.responses.size(); ++c) {
    const std::pair key{index_of(t.responses, model.responses[c]), index_of(t.references, model.references[c])};
    if (!found.emplace(key, static_cast<Index>(c)).second)
      t.twice.push_back(model.responses[c] + "/" + model.references[c]);
  }
  t.channel.assign(t.responses.size(), std::vector<Index>(t.references.size(), -1));
  for (const auto& [key, c] : found) t.channel[key.first][key.second] = c;
  return t;
}

// Part of the residues' energy that is not one product shape x participation; the median over the modes.
double misfit_of(const std::vector<MatrixXcd>& residues) {
  std::vector<double> parts;
  for (const MatrixXcd& a : residues) {
    const Eigen::SelfAdjointEigenSolver<MatrixXcd> energy(
        a.cols() < a.rows() ? MatrixXcd(a.adjoint() * a) : MatrixXcd(a * a.adjoint()), Eigen::EigenvaluesOnly);
    parts.push_back(1 - energy.eigenvalues().maxCoeff() / energy.eigenvalues().sum());
  }
  const auto middle = parts.begin() + static_cast<std::ptrdiff_t>(parts.size() / 2);
  std::nth_element(parts.begin(), middle, parts.end());
  return *middle;
}

struct Slip {
  std::string text;
  double misfit;
};

// What each slip, undone, leaves.
std::vector<Slip> undo(const Table& t, const std::vector<MatrixXcd>& residues) {
  std::vector<Slip> slips;
  const auto attempt = [&](std::string text, const auto& change) {
    std::vector<MatrixXcd> mended = residues;
    for (MatrixXcd& a : mended) change(a);
    slips.push_back({std::move(text), misfit_of(mended)});
  };
  constexpr double kGravity = 9.80665;
  for (std::size_t r = 0; r < t.references.size(); ++r) {
    const auto j = static_cast<Index>(r);
    for (std::size_t p = 0; p < t.responses.size(); ++p) {
      const auto i = static_cast<Index>(p);
      const std::string name = t.responses[p] + "/" + t.references[r];
      attempt(name + " is reversed", [&](MatrixXcd& a) { a(i, j) *= -1; });
      attempt(name + " is in g", [&](MatrixXcd& a) { a(i, j) *= kGravity; });
      attempt(name + " is 9.81 times too large (the others in g)", [&](MatrixXcd& a) { a(i, j) /= kGravity; });
      for (std::size_t q = p + 1; q < t.responses.size(); ++q) {
        const auto other = static_cast<Index>(q);
        attempt(fmt::format("{} and {}/{} are exchanged", name, t.responses[q], t.references[r]),
                [&](MatrixXcd& a) { std::swap(a(i, j), a(other, j)); });
      }
    }
  }
  std::sort(slips.begin(), slips.end(), [](const Slip& a, const Slip& b) { return a.misfit < b.misfit; });
  return slips;
}

}  // namespace

std::vector<std::string> contradicting_channels(const ModalModel& model) {
  const Table t = table_of(model);
  std::vector<std::string> said;
  if (!t.twice.empty())
    said.push_back(fmt::format("{} {} there more than once: is a point or a reference misnamed? Shapes take the first",
                               fmt::join(t.twice, ", "), t.twice.size() == 1 ? "is" : "are"));
  if (t.responses.size() < 2 || t.references.size() < 2 || t.responses.size() * t.references.size() > 400) return said;
  for (const auto& row : t.channel) {
    if (std::find(row.begin(), row.end(), Index{-1}) != row.end()) return said;
  }
  std::vector<MatrixXcd> residues;
  for (const Mode& mode : model.modes) {
    const bool known = mode.damping.sd < 0.1 * mode.damping.value && mode.frequency.value > model.band_low &&
                       mode.frequency.value < model.band_high;
    if (!known || mode.residues.squaredNorm() == 0) continue;
    MatrixXcd a(static_cast<Index>(t.responses.size()), static_cast<Index>(t.references.size()));
    for (Index i = 0; i < a.rows(); ++i) {
      for (Index j = 0; j < a.cols(); ++j)
        a(i, j) = mode.residues[t.channel[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)]];
    }
    residues.push_back(std::move(a));
  }
  if (residues.size() < 3) return said;
  // Noise and gains that are some percent off leave less than a hundredth of the energy.
  constexpr double kMisfit = 0.02;
  const double misfit = misfit_of(residues);
  if (misfit < kMisfit) return said;
  const std::vector<Slip> slips = undo(t, residues);
  const double best = slips.front().misfit;
  if (best > 0.25 * misfit) {
    said.push_back(
        fmt::format("the shapes seen from {} differ: {:.0f} % of the residues' energy (median over the modes) "
                    "is no product of a shape and a participation; channels may be misnamed or their gains off",
                    fmt::join(t.references, ", "), 100 * misfit));
    return said;
  }
  std::vector<std::string> names;
  for (const Slip& slip : slips) {
    if (slip.misfit < 1.5 * best + 1e-6 && names.size() < 4) names.push_back(slip.text);
  }
  said.push_back(fmt::format("the shapes seen from {} contradict each other; looks as if {}",
                             fmt::join(t.references, ", "), fmt::join(names, ", or ")));
  return said;
}

}  // namespace whirl::modal
