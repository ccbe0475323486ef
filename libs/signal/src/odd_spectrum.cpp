#include "odd_spectrum.hpp"

#include <fftw3.h>

#include "planning.hpp"

namespace whirl::signal {

OddSpectrum odd_spectrum(const Eigen::Ref<const Eigen::VectorXd>& x) {
  const Eigen::Index n = x.size();
  const Eigen::Index period = 2 * (n - 1);
  OddSpectrum s;
  s.start = x[0];
  s.slope = (x[n - 1] - x[0]) / static_cast<double>(n - 1);
  Eigen::VectorXd odd(period);
  for (Eigen::Index i = 0; i < n; ++i) odd[i] = x[i] - s.start - s.slope * static_cast<double>(i);
  for (Eigen::Index i = n; i < period; ++i) odd[i] = -odd[period - i];
  s.lines.resize(n);
  auto* out = reinterpret_cast<fftw_complex*>(s.lines.data());
  std::unique_lock lock(planning());
  fftw_plan plan = fftw_plan_dft_r2c_1d(static_cast<int>(period), odd.data(), out, FFTW_ESTIMATE);
  lock.unlock();
  fftw_execute(plan);
  lock.lock();
  fftw_destroy_plan(plan);
  s.lines /= static_cast<double>(period);
  return s;
}

Eigen::VectorXd inverse_spectrum(const Eigen::VectorXcd& lines, Eigen::Index count) {
  Eigen::VectorXcd input = lines;  // the inverse transform overwrites its input
  Eigen::VectorXd out(2 * (lines.size() - 1));
  std::unique_lock lock(planning());
  fftw_plan plan = fftw_plan_dft_c2r_1d(static_cast<int>(out.size()), reinterpret_cast<fftw_complex*>(input.data()),
                                        out.data(), FFTW_ESTIMATE);
  lock.unlock();
  fftw_execute(plan);
  lock.lock();
  fftw_destroy_plan(plan);
  return out.head(count);
}

}  // namespace whirl::signal
