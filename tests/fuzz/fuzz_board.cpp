// Datagrams of the converter board, both ways: what is read is finite, and is written back as the same bytes.
#include <algorithm>
#include <array>
#include <cmath>

#include "harness.hpp"
#include "whirl/rt/drivers/udp_board.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  using namespace whirl::rt;
  const std::span<const std::byte> data(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size());
  if (const auto command = board::decode_command(data)) {
    require(std::isfinite(command->command.volts[0]) && std::isfinite(command->command.volts[1]));
    std::array<std::byte, board::kCommandSize> again;
    board::encode(*command, again);
    const auto back = board::decode_command(again);
    require(back && back->number == command->number && back->command.volts == command->command.volts);
  }
  if (const auto reading = board::decode_reading(data)) {
    require(std::isfinite(reading->beta) && std::isfinite(reading->omega) && std::isfinite(reading->omega_dot));
    std::array<std::byte, board::kReadingSize> again;
    board::encode(*reading, again);
    const auto back = board::decode_reading(again);
    require(back && back->tick == reading->tick && back->beta == reading->beta && back->done == reading->done);
  }
  only_errors([&] { board::parse_address(std::string(bytes)); });
}
