// The rate at which a connection takes bytes, told only where the connection is what holds them up.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>

namespace helio {

class SendRate {
 public:
  using Time = std::chrono::steady_clock::time_point;

  void write_begun(Time now);
  // Bytes a second of the last half second or more, once writes were under way for most of it.
  std::optional<double> write_ended(std::size_t bytes, Time now);
  // The last megabytes were taken as fast as only a fast connection takes them. False at first.
  bool fast() const { return fast_; }

 private:
  std::optional<Time> since_;  // of the writes that are looked at
  Time begun_, ended_;
  std::chrono::duration<double> writing_{0};
  double bytes_ = 0;

  bool fast_ = false;
  std::chrono::duration<double> recent_writing_{0};
  double recent_bytes_ = 0;
};

}  // namespace helio
