// Pass: estimates the error of the whole region from its two halves.
#pragma once

#include "renderer/film/resolve.h"

namespace helio {

class MeasurePass {
 public:
  // Not thread safe: the owner's lock guards it.
  void begin(bool wanted) { open_ = wanted; }
  bool next() {
    const bool taken = open_;
    in_flight_ += taken;
    open_ = false;
    return taken;
  }
  bool any_open() const { return open_; }
  void finish() { --in_flight_; }
  void stop() { open_ = false; }
  bool finished() const { return !open_ && in_flight_ == 0; }

 private:
  bool open_ = false;
  int in_flight_ = 0;
};

}  // namespace helio
