#pragma once
#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/expr/tape.hpp"

namespace whirl::response {

/// What forces the system. Neither input nor base: the rotor turns, X5 = Omega t, X6 = Omega, X7 = 0, other inputs 0.
/// Otherwise the rotor is at rest, the other inputs 0, and either the input is amplitude * cos(Omega t), or the support
/// moves amplitude * cos(Omega t) along the coordinate `base`: its velocity's equation gains Omega^2 amplitude
/// cos(Omega t), the coordinates being read against the support (Harris' Shock and Vibration Handbook, ch. 2).
struct Forcing {
  std::string input;
  double amplitude = 0;         ///< unit of the input, or of the coordinate `base`; 0 to peak
  double unbalance_scale = 1;   ///< rotor models: multiplies every term of the angle (eccentricity at the same angle)
  bool free_unbalance = false;  ///< rotor models: the force of a curve multiplies the unbalance too, and must be given
  std::string base{};           ///< coordinate of order 2 along which the support moves
  bool turning() const { return input.empty() && base.empty(); }
};

/// A model as q^(order) = f(q, q', tau, Omega, F) with tau = Omega t in 0..2 pi. A state whose equation is another
/// state alone (X1' = X2) is a coordinate of order 2 and the other its velocity; the rest are of order 1.
class PeriodicSystem {
 public:
  /// Throws Error for maps, states without equation, an unknown input or base, or terms of other names.
  PeriodicSystem(const IdentifiedModel& model, const Forcing& forcing);

  Eigen::Index size() const { return static_cast<Eigen::Index>(names_.size()); }  ///< coordinates
  const std::vector<std::string>& names() const { return names_; }
  int order(Eigen::Index i) const { return order_[static_cast<std::size_t>(i)]; }
  double forcing_amplitude() const { return amplitude_; }
  bool driven_by_angle() const { return angle_; }

  /// Where an entry comes from: a column of the tape, or a constant (column < 0).
  struct Place {
    int column = -1;
    double constant = 0;
  };
  /// What is evaluated: the less, the faster.
  enum class Part { f, slopes, all };
  /// One number of the system over a period: the same at every point (`samples` null), or one value a point.
  struct Entry {
    double constant = 0;
    const double* samples = nullptr;
    double operator[](Eigen::Index point) const { return samples != nullptr ? samples[point] : constant; }
    bool zero() const { return samples == nullptr && constant == 0; }
  };
  /// f and its derivatives at points of a period.
  class Values {
   public:
    Entry f(Eigen::Index i) const { return entry(i); }
    Entry by_q(Eigen::Index i, Eigen::Index j) const { return entry(size_ + i * size_ + j); }  ///< df_i / dq_j
    Entry by_v(Eigen::Index i, Eigen::Index j) const { return entry(size_ + (size_ + i) * size_ + j); }
    Entry by_speed(Eigen::Index i) const { return entry(size_ + 2 * size_ * size_ + i); }
    Entry by_force(Eigen::Index i) const { return entry(2 * size_ + 2 * size_ * size_ + i); }

   private:
    friend class PeriodicSystem;
    Entry entry(Eigen::Index k) const {
      const Place& place = (*places_)[static_cast<std::size_t>(k)];
      return {place.constant, place.column < 0 ? nullptr : samples_.col(place.column).data()};
    }
    Eigen::MatrixXd samples_;
    const std::vector<Place>* places_ = nullptr;
    Eigen::Index size_ = 0;
  };
  /// `q`, `v`: points x size (v of order-1 coordinates is not read). Entries outside `part` are 0.
  Values evaluate(Part part, const Eigen::MatrixXd& q, const Eigen::MatrixXd& v, const Eigen::VectorXd& tau,
                  double omega, double force) const;

 private:
  struct Compiled {
    expr::Tape tape;
    std::vector<Place> places;  ///< of f, by_q, by_v, by_speed, by_force, one after the other
  };
  std::vector<std::string> names_;
  std::vector<int> order_;
  std::array<Compiled, 3> parts_;  ///< by Part
  double amplitude_ = 0;
  bool angle_ = false;
};

/// The five parameters (and anisotropy) of a rotor as equations of X1..X7: for models that hold only the rotor.
IdentifiedModel rotor_equations(const RotorModel& rotor);

}  // namespace whirl::response
