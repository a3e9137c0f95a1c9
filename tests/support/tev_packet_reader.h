// Reads packets for tev from the description of its protocol alone, and refuses whatever departs from it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "renderer/base/result.h"

namespace helio::test {

struct TevPacket {
  enum class Type { open = 0, reload = 1, close = 2, create = 4, update = 6, open_v2 = 7, vector_graphics = 8 };
  Type type = Type::open;
  bool grab_focus = false;
  std::string name;      // of the image; of open: the path
  std::string selector;  // open_v2
  std::vector<std::string> channels;
  int x = 0, y = 0, width = 0, height = 0;  // update; create: the last two
  std::vector<std::vector<float>> planes;   // update: as channels, width * height floats each
  bool append = false;                      // vector_graphics, as what follows
  struct Command {
    int type = 0;
    std::vector<float> numbers;
    std::string text;
  };
  std::vector<Command> commands;
};

// `bytes`: one packet, its length included. Errors say what is wrong and at which byte.
Result<TevPacket> read_tev_packet(std::string_view bytes);

}  // namespace helio::test
