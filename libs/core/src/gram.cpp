#include "whirl/core/gram.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "whirl/core/wide_registers.hpp"

namespace whirl {
namespace {

using Eigen::Index;

constexpr Index kHigh = 3, kWide = 4;  // 12 sums and what they are made of fill 16 registers
using Sums = std::array<std::array<double, kWide>, kHigh>;

/// Products of kHigh columns by kWide columns over `rows` rows.
Sums products(const std::array<const double*, kHigh>& a, const std::array<const double*, kWide>& b, Index rows) {
  Register sum[kHigh][kWide] = {};
  Index r = 0;
  for (; r + kRegisterWidth <= rows; r += kRegisterWidth) {
    Register left[kHigh];
#pragma GCC unroll 3
    for (std::size_t x = 0; x < kHigh; ++x) std::memcpy(&left[x], a[x] + r, sizeof left[x]);
#pragma GCC unroll 4
    for (std::size_t y = 0; y < kWide; ++y) {
      Register right;
      std::memcpy(&right, b[y] + r, sizeof right);
#pragma GCC unroll 3
      for (std::size_t x = 0; x < kHigh; ++x) sum[x][y] += left[x] * right;
    }
  }
  Sums out;
  for (std::size_t x = 0; x < kHigh; ++x) {
    for (std::size_t y = 0; y < kWide; ++y) {
      out[x][y] = 0;
      for (int k = 0; k < kRegisterWidth; ++k) out[x][y] += sum[x][y][k];
      for (Index k = r; k < rows; ++k) out[x][y] += a[x][k] * b[y][k];
    }
  }
  return out;
}

void add(const double* data, Index stride, Index n, Index p, Eigen::MatrixXd& sum) {
  constexpr Index kRows = 512;  // of all columns stay in the second cache
  for (Index first = 0; first < n; first += kRows) {
    const Index rows = std::min(n - first, kRows);
    // Beyond the last column stands the last again; its sums are not taken.
    const auto column = [&](Index k) { return data + stride * std::min(k, p - 1) + first; };
    for (Index j = 0; j < p; j += kWide) {
      for (Index i = j / kHigh * kHigh; i < p; i += kHigh) {
        const Sums s = products({column(i), column(i + 1), column(i + 2)},
                                {column(j), column(j + 1), column(j + 2), column(j + 3)}, rows);
        for (Index x = 0; x < std::min(kHigh, p - i); ++x) {
          for (Index y = 0; y < kWide && j + y <= i + x; ++y)
            sum(i + x, j + y) += s[static_cast<std::size_t>(x)][static_cast<std::size_t>(y)];
        }
      }
    }
  }
}

}  // namespace

void add_gram(const Eigen::Ref<const Eigen::MatrixXd>& columns, Eigen::MatrixXd& sum) {
  if (columns.cols() == 0) return;
  on_wide_registers([&] { add(columns.data(), columns.outerStride(), columns.rows(), columns.cols(), sum); });
}

}  // namespace whirl
