#include "processor.hpp"
#include "program.hpp"

int main(int argc, char** argv) {
  whirl::app::go_on_as_the_faster_build(argv);
  return whirl::app::program(argc, argv);
}
