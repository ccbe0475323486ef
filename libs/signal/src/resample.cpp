#include "whirl/signal/resample.hpp"

#include "odd_spectrum.hpp"
#include "whirl/core/error.hpp"

namespace whirl::signal {

Eigen::VectorXd upsample(const Eigen::Ref<const Eigen::VectorXd>& x, int factor) {
  if (factor < 1) throw Error::in_field("resampling factor", std::to_string(factor), "at least 1");
  if (x.size() < 3) throw Error::in_field("samples to resample", std::to_string(x.size()), "at least 3");
  if (factor == 1) return x;
  const OddSpectrum s = odd_spectrum(x);
  const Eigen::Index n = x.size();
  const Eigen::Index fine = (n - 1) * factor + 1;
  Eigen::VectorXcd lines = Eigen::VectorXcd::Zero(fine);
  lines.head(n) = s.lines;
  lines[n - 1] *= 0.5;  // the Nyquist line is shared by both signs of frequency
  Eigen::VectorXd y = inverse_spectrum(lines, fine);
  for (Eigen::Index i = 0; i < fine; ++i) y[i] += s.start + s.slope * static_cast<double>(i) / factor;
  return y;
}

}  // namespace whirl::signal
