#include "whirl/signal/fft.hpp"

#include <fftw3.h>
#include <fmt/format.h>

#include <map>
#include <memory>
#include <tuple>
#include <type_traits>

#include "planning.hpp"
#include "whirl/core/error.hpp"

namespace whirl::signal {
namespace {

enum class Transform { forward, backward, real_forward };

fftw_complex* as_fftw(const std::complex<double>* p) {
  return reinterpret_cast<fftw_complex*>(const_cast<std::complex<double>*>(p));
}

struct DestroyPlan {
  void operator()(fftw_plan plan) const { fftw_destroy_plan(plan); }
};
using Plan = std::unique_ptr<std::remove_pointer_t<fftw_plan>, DestroyPlan>;

// Plans are kept for the life of the program; FFTW_UNALIGNED lets every plan run on any Eigen buffer.
fftw_plan plan_for(Transform transform, int n) {
  static std::map<std::pair<Transform, int>, Plan> plans;
  const std::lock_guard lock(planning());
  Plan& kept = plans[{transform, n}];
  if (kept == nullptr) {
    fftw_plan plan = nullptr;
    Eigen::VectorXcd a(n);
    Eigen::VectorXcd b(n);
    const unsigned flags = FFTW_ESTIMATE | FFTW_UNALIGNED;
    auto* real = reinterpret_cast<double*>(b.data());
    switch (transform) {
      case Transform::forward:
        plan = fftw_plan_dft_1d(n, as_fftw(a.data()), as_fftw(b.data()), FFTW_FORWARD, flags | FFTW_PRESERVE_INPUT);
        break;
      case Transform::backward:
        plan = fftw_plan_dft_1d(n, as_fftw(a.data()), as_fftw(b.data()), FFTW_BACKWARD, flags | FFTW_PRESERVE_INPUT);
        break;
      case Transform::real_forward:
        plan = fftw_plan_dft_r2c_1d(n, real, as_fftw(a.data()), flags | FFTW_PRESERVE_INPUT);
        break;
    }
    if (plan == nullptr) throw Error(fmt::format("no Fourier transform of length {} could be planned", n));
    kept.reset(plan);
  }
  return kept.get();
}

int checked_length(Eigen::Index n) {
  if (n < 1 || n > 1 << 30) throw Error(fmt::format("transform length {}: must be between 1 and 2^30", n));
  return static_cast<int>(n);
}

}  // namespace

Eigen::VectorXcd fft(const Eigen::Ref<const Eigen::VectorXcd>& x) {
  Eigen::VectorXcd result(x.size());
  fftw_execute_dft(plan_for(Transform::forward, checked_length(x.size())), as_fftw(x.data()), as_fftw(result.data()));
  return result;
}

Eigen::VectorXcd inverse_fft(const Eigen::Ref<const Eigen::VectorXcd>& spectrum) {
  Eigen::VectorXcd result(spectrum.size());
  fftw_execute_dft(plan_for(Transform::backward, checked_length(spectrum.size())), as_fftw(spectrum.data()),
                   as_fftw(result.data()));
  result /= static_cast<double>(spectrum.size());
  return result;
}

Eigen::VectorXcd real_fft(const Eigen::Ref<const Eigen::VectorXd>& x) {
  Eigen::VectorXcd result(x.size() / 2 + 1);
  fftw_execute_dft_r2c(plan_for(Transform::real_forward, checked_length(x.size())), const_cast<double*>(x.data()),
                       as_fftw(result.data()));
  return result;
}

Eigen::Index fast_fft_length(Eigen::Index n) {
  for (Eigen::Index m = std::max<Eigen::Index>(n, 1);; ++m) {
    Eigen::Index rest = m;
    for (Eigen::Index prime : {2, 3, 5}) {
      while (rest % prime == 0) rest /= prime;
    }
    if (rest == 1) return m;
  }
}

}  // namespace whirl::signal
