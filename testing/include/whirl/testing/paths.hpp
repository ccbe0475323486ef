#pragma once
#include <string>

namespace whirl::testing {

// Where this checkout, its build tree, the measured data and the program are. They are functions defined in one
// generated source (testing/src/paths.cpp.in): all other objects of the tests are the same bytes in every checkout, so
// that a compiler cache shares them.
std::string source_dir();
std::string binary_dir();
std::string data_dir();  ///< as given at configure time; $WHIRL_DATA comes first (data.hpp)
std::string program();   ///< the whirl program

}  // namespace whirl::testing
