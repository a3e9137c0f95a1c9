// What scenes, films, bundles and queues may hold together, counted before anything is allocated.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

#include "renderer/base/memory_ledger.h"
#include "renderer/base/result.h"

namespace helio {

class MemoryAccount;

// What reserved memory is for, as the metrics tell it.
enum class MemoryOwner {
  scenes,
  devices,  // scenes that lie on Vulkan devices
  uploads,
  films,
  light_vertices,
  previews,
  display,
  queues,
  pictures,  // of kept jobs and of comparisons
  references,
  checkpoints,
  other,
};
inline constexpr std::size_t kMemoryOwners = std::size_t(MemoryOwner::other) + 1;
const char* to_string(MemoryOwner owner);

// A share of the account, given back when it goes.
class Reservation {
 public:
  Reservation() = default;
  Reservation(Reservation&& other) noexcept { *this = std::move(other); }
  Reservation& operator=(Reservation&& other) noexcept;
  ~Reservation() { release(); }

  std::uint64_t bytes() const { return bytes_; }
  void release();

 private:
  friend class MemoryAccount;
  friend class GrowingReservation;
  Reservation(MemoryAccount* account, std::uint64_t bytes, MemoryOwner owner)
      : account_(account), bytes_(bytes), owner_(owner) {}

  MemoryAccount* account_ = nullptr;
  std::uint64_t bytes_ = 0;
  MemoryOwner owner_ = MemoryOwner::other;
};

// Gives memory back that is held for later and that nobody uses now: of sessions without a listener, for one.
class RoomMaker {
 public:
  virtual ~RoomMaker() = default;
  // Called when so many bytes are not left, without a lock of the account. May take seconds. True: it is worth another
  // try. False: so much cannot be had.
  virtual bool make_room(std::uint64_t bytes) = 0;
  // Upper bound of the bytes that make_room() could free now.
  virtual std::uint64_t could_free() const = 0;
};

// Thread safe. Outlives its reservations.
class MemoryAccount {
 public:
  // `room` frees memory for reserve_with_room() and GrowingReservation::grow(); null: nothing is freed. reserve() never
  // calls it.
  explicit MemoryAccount(std::uint64_t limit, RoomMaker* room = nullptr) : room_(room), limit_(limit) {}
  // A share of `parent` for one owner, the token of this name: what is reserved here is reserved there, too. Without a
  // limit of its own until set_limit(). `room` frees what this owner holds.
  MemoryAccount(MemoryAccount& parent, std::string owner, RoomMaker* room);

  // resource_exhausted, naming max_memory or the owner's quota, when less is left. `what` completes "... for WHAT".
  Result<Reservation> reserve(std::uint64_t bytes, const std::string& what, MemoryOwner owner = MemoryOwner::other);
  // As reserve(), but when too little is left it asks the RoomMaker to free memory and tries again. Not to be called
  // with a lock that ending a session or evicting a scene needs.
  Result<Reservation> reserve_with_room(std::uint64_t bytes, const std::string& what,
                                        MemoryOwner owner = MemoryOwner::other);

  std::uint64_t limit() const;
  // Less than what is used: nothing is taken away, and nothing more is given.
  void set_limit(std::uint64_t limit);
  std::uint64_t used() const;
  std::uint64_t peak() const;  // the most that was ever used
  // What is left; of a share, no more than the parent has.
  std::uint64_t available() const;
  // Of a share: what its own limit leaves.
  std::uint64_t own_available() const;
  // By owner, at [std::size_t(MemoryOwner::films)] for one; their sum is used().
  std::array<std::uint64_t, kMemoryOwners> used_by_owner() const;
  // Requests that were refused so far, those of shares included.
  std::uint64_t refusals() const { return refusals_.load(std::memory_order_relaxed); }
  // What is left and what could be freed for who needs it.
  std::uint64_t obtainable() const;

 private:
  friend class Reservation;
  friend class GrowingReservation;
  bool take(std::uint64_t bytes, MemoryOwner owner) noexcept;
  // With room made for it.
  bool obtain(std::uint64_t bytes, MemoryOwner owner);
  void give_back(std::uint64_t bytes, MemoryOwner owner) noexcept;
  // These of this account alone, without the parent.
  bool take_own(std::uint64_t bytes, MemoryOwner owner) noexcept;
  bool obtain_own(std::uint64_t bytes, MemoryOwner owner);
  void give_back_own(std::uint64_t bytes, MemoryOwner owner) noexcept;
  // `in_all`: with what the caller holds already.
  Error refusal(std::uint64_t bytes, const std::string& what, std::uint64_t in_all) const;

  MemoryAccount* const parent_ = nullptr;  // null: this is no share
  const std::string owner_ = {};           // of a share
  RoomMaker* const room_;
  mutable std::mutex mutex_;
  std::uint64_t limit_;
  std::uint64_t used_ = 0, peak_ = 0;
  std::array<std::uint64_t, kMemoryOwners> by_owner_{};
  mutable std::atomic<std::uint64_t> refusals_{0};
};

// Reservation of work whose memory is not known in advance: it grows before each allocation, with room made for it, and
// in the end split() hands over what was made. The rest is given back when it goes.
class GrowingReservation final : public MemoryLedger {
 public:
  explicit GrowingReservation(MemoryAccount& account, MemoryOwner owner = MemoryOwner::other)
      : account_(account), owner_(owner) {}
  GrowingReservation(const GrowingReservation&) = delete;
  GrowingReservation& operator=(const GrowingReservation&) = delete;
  ~GrowingReservation() override { account_.give_back(held_, owner_); }

  bool grow(std::uint64_t bytes) noexcept override;
  void shrink(std::uint64_t bytes) noexcept override;
  std::uint64_t held() const override;
  Error refusal(std::uint64_t bytes, const std::string& what) const override;

  // Splits off `bytes` as a Reservation of their own, of the same owner; when less is held, the difference is reserved
  // as by reserve().
  // Errors: as reserve().
  Result<Reservation> split(std::uint64_t bytes, const std::string& what);

 private:
  MemoryAccount& account_;
  const MemoryOwner owner_;
  mutable std::mutex mutex_;
  std::uint64_t held_ = 0;
};

}  // namespace helio
