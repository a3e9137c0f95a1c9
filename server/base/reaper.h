// Frees what takes long to free, films above all, on a thread of its own: neither timers nor gRPC's threads wait for
// it. Some time after the last of it the allocator gives what is free back to the system.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

namespace helio {

class Reaper {
 public:
  // An object that can be handed over. Taking it allocates nothing.
  class Item {
   public:
    virtual ~Item() = default;

   private:
    friend class Reaper;
    Item* next_ = nullptr;
  };

  Reaper();
  ~Reaper();  // frees what waits

  // Deletes it soon. Thread safe, as are all.
  void take(Item* item) noexcept;
  // Returns when all that was taken before has been freed. Not to be called by what is freed.
  void wait_until_idle();

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_, idle_;
  Item* waiting_ = nullptr;
  std::uint64_t taken_ = 0, freed_ = 0;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace helio
