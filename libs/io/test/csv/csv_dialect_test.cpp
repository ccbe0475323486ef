#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::io {
namespace {

struct Dialect {
  char delimiter, decimal;
  bool bom, crlf, trailing, quoted_header, blank_end, blanks;
};

/// The same numbers as text in a dialect.
std::string written(const std::vector<std::string>& header, const std::vector<std::vector<double>>& rows,
                    const Dialect& d) {
  std::string out = d.bom ? "\xef\xbb\xbf" : "";
  const std::string end = std::string(d.trailing ? 1 : 0, d.delimiter) + (d.crlf ? "\r\n" : "\n");
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (i > 0) out += d.delimiter;
    out += d.quoted_header ? "\"" + header[i] + "\"" : header[i];
  }
  out += end;
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      std::string number = fmt::format("{}", row[i]);
      std::replace(number.begin(), number.end(), '.', d.decimal);
      if (i > 0) out += d.delimiter;
      out += d.blanks ? " " + number + " " : number;
    }
    out += end;
  }
  if (d.blank_end) out += d.crlf ? "\r\n\r\n" : "\n";
  return out;
}

TEST(CsvProperty, EveryDialectGivesTheSameDoubles) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> mantissa(-1, 1);
  std::uniform_int_distribution<int> exponent(-30, 30);
  const std::vector<std::string> header{"t_s", "x_m", "ux_N"};
  std::vector<std::vector<double>> rows;
  for (int i = 0; i < 40; ++i) {
    rows.push_back({0.25 * i, mantissa(random) * std::pow(10.0, exponent(random)), mantissa(random)});
  }
  int dialects = 0;
  for (unsigned bits = 0; bits < 64; ++bits) {
    for (const auto& [delimiter, decimal] : {std::pair{',', '.'}, {';', '.'}, {';', ','}, {'\t', ','}, {'\t', '.'}}) {
      const Dialect d{delimiter,       decimal,         (bits & 1) != 0,  (bits & 2) != 0,
                      (bits & 4) != 0, (bits & 8) != 0, (bits & 16) != 0, (bits & 32) != 0};
      const Recording r = parse_csv(written(header, rows, d), "d.csv");
      ASSERT_EQ(r.size(), 40);
      ASSERT_EQ(r.dt, 0.25);
      for (Eigen::Index i = 0; i < 40; ++i) {
        ASSERT_EQ(r["x"][i], rows[static_cast<std::size_t>(i)][1]) << to_string(CsvDialect{delimiter, decimal});
        ASSERT_EQ(r["ux"][i], rows[static_cast<std::size_t>(i)][2]);
      }
      ++dialects;
    }
  }
  EXPECT_EQ(dialects, 320);
}

TEST(CsvProperty, LinesAcrossBufferAndBlockLimitsAreWhole) {
  // Three buffers of 1 MiB and many blocks; every value tells its row.
  std::string text = "t_s,x_m\n";
  const int n = 300000;
  for (int i = 0; i < n; ++i) text += fmt::format("{},{}\n", i, 3 * i);
  ASSERT_GT(text.size(), std::size_t{3} << 20);
  const Recording r = parse_csv(text, "long.csv");
  ASSERT_EQ(r.size(), n);
  for (Eigen::Index i = 0; i < n; ++i) ASSERT_EQ(r["x"][i], 3.0 * static_cast<double>(i));
  text.insert(text.size() - 3, "x");
  try {
    parse_csv(text, "long.csv");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(std::string_view(e.what()).substr(0, 16), "long.csv:300001:");
  }
}

TEST(CsvProperty, ARemovedSampleIsAlwaysNoticed) {
  std::mt19937_64 random(4);
  for (const double rate : {1000.0, 610.3516, 4096.0, 51200.0}) {
    for (int trial = 0; trial < 50; ++trial) {
      const int n = 4 + static_cast<int>(random() % 200);
      const int removed = 1 + static_cast<int>(random() % static_cast<unsigned>(n - 2));
      std::string whole = "t_s,x_m\n", holed = whole;
      for (int i = 0; i < n; ++i) {
        const std::string line = fmt::format("{:.6f},{}\n", i / rate, i);
        whole += line;
        if (i != removed) holed += line;
      }
      ASSERT_NO_THROW(parse_csv(whole, "a.csv")) << rate << " " << n;
      ASSERT_THROW(parse_csv(holed, "a.csv"), Error) << rate << " " << n << " " << removed;
    }
  }
}

}  // namespace
}  // namespace whirl::io
