#include "whirl/core/gram.hpp"

#include <gtest/gtest.h>

namespace whirl {
namespace {

TEST(GramProperty, AddsTheProductsOfColumnsOfAnyNumberAndLength) {
  std::srand(1);
  for (const Eigen::Index columns : {0, 1, 2, 3, 4, 5, 7, 12, 13, 30}) {
    for (const Eigen::Index rows : {0, 1, 3, 8, 17, 511, 512, 513, 2000}) {
      const Eigen::MatrixXd wide = Eigen::MatrixXd::Random(rows + 5, columns + 2);
      const Eigen::MatrixXd before = Eigen::MatrixXd::Random(columns, columns);
      const auto part = wide.block(3, 1, rows, columns);  // neither begins nor ends with its columns
      Eigen::MatrixXd sum = before;
      add_gram(part, sum);
      const Eigen::MatrixXd expected = before + part.transpose() * part;
      for (Eigen::Index j = 0; j < columns; ++j) {
        for (Eigen::Index i = 0; i < columns; ++i) {
          EXPECT_NEAR(sum(i, j), i >= j ? expected(i, j) : before(i, j), 1e-12 * (1 + static_cast<double>(rows)))
              << columns << " " << rows << " " << i << " " << j;
        }
      }
    }
  }
}

}  // namespace
}  // namespace whirl
