#pragma once
#include <zlib.h>

#include <Eigen/Core>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace whirl::testing {

/// Numbers of a gzipped CSV file with one header line.
inline Eigen::MatrixXd read_csv_gz(const std::filesystem::path& path) {
  gzFile file = gzopen(path.c_str(), "rb");
  if (file == nullptr) throw std::runtime_error("cannot open " + path.string());
  std::vector<double> values;
  std::vector<char> line(1 << 16);
  Eigen::Index columns = 0;
  gzgets(file, line.data(), static_cast<int>(line.size()));
  while (gzgets(file, line.data(), static_cast<int>(line.size())) != nullptr) {
    Eigen::Index count = 0;
    for (char* at = line.data(); *at != '\0' && *at != '\n'; ++count) {
      values.push_back(std::strtod(at, &at));
      if (*at == ',') ++at;
    }
    columns = std::max(columns, count);
  }
  gzclose(file);
  return Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      values.data(), static_cast<Eigen::Index>(values.size()) / columns, columns);
}

}  // namespace whirl::testing
