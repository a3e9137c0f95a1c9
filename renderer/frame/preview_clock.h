// When a session that asks for previews begins a preview, and when the film. Pure: reads no clock, so that tests
// compare decisions.
//
// A change of what is seen makes a preview due; it begins as soon as no other is in hand, at most `rate` times a
// second. The film begins when the preview of the newest view is out and nothing has changed for the rest wait. So a
// camera that moves on and on shows previews alone. A preview that the rate puts off beyond the rest wait is not made:
// the film does not wait for it.
#pragma once

#include <limits>

namespace helio {

class PreviewClock {
 public:
  // Seconds without a change after which the camera is taken to rest.
  static constexpr double kRestWait = 0.1;

  // Previews a second, at most; 0: none, the film begins at once.
  void set_rate(double rate) {
    rate_ = rate;
    if (!(rate > 0)) due_ = false;
  }
  bool on() const { return rate_ > 0; }
  // View, scene, or settings that show are others from now on.
  void changed(double now_s) {
    due_ = on();
    changed_s_ = now_s;
  }
  void begun(double now_s) {
    due_ = false;
    begun_s_ = now_s;
  }
  void film_begun() { due_ = false; }

  enum class Next { preview, film };
  struct Decision {
    Next next = Next::film;
    double at_s = 0;  // not before; in the past: at once

    bool operator==(const Decision&) const = default;
  };
  // Precondition: no preview is in hand.
  Decision decide() const;

 private:
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  double rate_ = 0;
  bool due_ = false;
  double changed_s_ = kNever, begun_s_ = kNever;  // the newest change | preview
};

}  // namespace helio
