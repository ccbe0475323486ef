#pragma once
#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/modal_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io {

/// Axis of a function (dataset 58): what it shows and in which unit, as written in the file.
struct UffAxis {
  int type = 0;  ///< 0 unknown, 1 general, 8 displacement, 11 velocity, 12 acceleration, 13 force, 15 pressure, 17
                 ///< time, 18 frequency
  std::string label = {};
  std::string unit = {};
};

struct UffPoint {
  std::string name = "NONE";
  long node = 0;
  int direction = 0;  ///< +-1..3 = +-X, Y, Z; +-4..6 rotations; 0 scalar
};

/// Function at nodal degrees of freedom (datasets 58 and 58b).
struct UffFunction {
  std::array<std::string, 5> id = {};
  int type =
      0;  ///< 1 time response, 2 auto, 3 cross spectrum, 4 frequency response, 6 coherence, 9 power spectral density
  UffPoint response = {}, reference = {};
  bool complex = false;
  bool single = true;  ///< stored with single precision
  bool even = true;
  double x0 = 0, dx = 0;
  Eigen::VectorXd x = {};       ///< abscissa when not even
  Eigen::VectorXcd value = {};  ///< imaginary part zero when not complex; unit of the file
  long declared = 0;            ///< count stated by the header; more than value.size() when the file is cut off
  UffAxis abscissa = {}, ordinate = {}, denominator = {}, z = {};
};

/// Data at nodes (dataset 55): a mode shape or one line of a response.
struct UffShape {
  std::array<std::string, 5> id = {};
  int analysis = 2;  ///< 2 normal mode, 3 complex eigenvalue, 5 frequency response, 7 complex eigenvalue second order
  int characteristic = 2;  ///< 2 three translations, 3 translations and rotations
  int specific = 8;        ///< 8 displacement, 11 velocity, 12 acceleration
  bool complex = false;
  std::vector<long> integers = {};  ///< load case, mode number, ...
  std::vector<double> reals = {};   ///< analysis 2: frequency Hz, modal mass, viscous, hysteretic damping; 3:
                                    ///< eigenvalue, modal A, modal B (Re, Im)
  std::vector<long> nodes = {};
  Eigen::MatrixXcd value = {};  ///< nodes x values per node
};

struct UffNode {
  long label = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};
struct UffTrace {
  std::string id = {};
  std::vector<long> nodes = {};  ///< 0 = pen up
};
struct UffElement {
  long label = 0;
  int type = 0;  ///< 91 thin triangle, 94 thin quadrilateral, ...
  std::vector<long> nodes = {};
};
struct UffSystem {
  long label = 0;
  int type = 0;
  std::string name = {};
  Eigen::Vector3d origin = Eigen::Vector3d::Zero(), x_point = Eigen::Vector3d::Zero(),
                  xz_point = Eigen::Vector3d::Zero();
};
/// Dataset 164. A value of the file divided by the factor is SI.
struct UffUnits {
  int code = 1;  ///< 1 SI, 9 user defined
  std::string description = {};
  double length = 1, force = 1, temperature = 1, temperature_offset = 273.15;
};

/// Everything a universal file holds, in its own units.
struct UffFile {
  std::string source = {};
  std::vector<UffFunction> functions = {};
  std::vector<UffShape> shapes = {};
  std::vector<UffNode> nodes = {};
  std::vector<UffTrace> traces = {};
  std::vector<UffElement> elements = {};
  std::vector<UffSystem> systems = {};
  std::vector<UffUnits> units = {};
  std::vector<std::string> header = {};    ///< lines of dataset 151
  std::vector<int> skipped = {};           ///< numbers of the datasets that were passed over
  std::vector<std::string> warnings = {};  ///< cut off data, unclosed blocks, more than one unit system
};

/// Reads datasets 15, 18, 55, 58, 58b, 82, 151, 164, 2411, 2412; passes over the others. `.gz` is read directly.
/// Throws Error with file and line where a number is expected and there is none, or a block breaks off inside its
/// header. Data shorter than declared are returned as far as they go, with a warning.
UffFile read_uff(const std::filesystem::path& path);
UffFile parse_uff(std::string_view bytes, std::string_view name);

/// Writes datasets 151, 164, 15, 82, 2412, 55 and 58 (ASCII) as present. Text fields longer than their columns are cut.
void write_uff(const std::filesystem::path& path, const UffFile& file);
std::string format_uff(const UffFile& file);

/// The functions of a file as signals, in SI where the axis of a function (or dataset 164) states the unit. Points are
/// named "node:+X".
SignalFile signals_from_uff(const UffFile& file);

/// The frequency responses of a file in SI: motion per force by the axis types and units. Points are named "node:+X".
FrequencyResponse frf_from_uff(const UffFile& file, std::optional<FrfKind> kind = {});
UffFile uff_from_frf(const FrequencyResponse& frf);
UffFile uff_from_recording(const Recording& recording);

}  // namespace whirl::io
