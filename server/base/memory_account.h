// What scenes, films, bundles and queues may hold together, counted before anything is allocated.
#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

#include "renderer/base/memory_ledger.h"
#include "renderer/base/result.h"

namespace helio {

class MemoryAccount;

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
  Reservation(MemoryAccount* account, std::uint64_t bytes) : account_(account), bytes_(bytes) {}

  MemoryAccount* account_ = nullptr;
  std::uint64_t bytes_ = 0;
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
  Result<Reservation> reserve(std::uint64_t bytes, const std::string& what);
  // As reserve(), but when too little is left it asks the RoomMaker to free memory and tries again. Not to be called
  // with a lock that ending a session or evicting a scene needs.
  Result<Reservation> reserve_with_room(std::uint64_t bytes, const std::string& what);

  std::uint64_t limit() const;
  // Less than what is used: nothing is taken away, and nothing more is given.
  void set_limit(std::uint64_t limit);
  std::uint64_t used() const;
  std::uint64_t peak() const;  // the most that was ever used
  // What is left; of a share, no more than the parent has.
  std::uint64_t available() const;
  // Of a share: what its own limit leaves.
  std::uint64_t own_available() const;
  // What is left and what could be freed for who needs it.
  std::uint64_t obtainable() const;

 private:
  friend class Reservation;
  friend class GrowingReservation;
  bool take(std::uint64_t bytes) noexcept;
  // With room made for it.
  bool obtain(std::uint64_t bytes);
  void give_back(std::uint64_t bytes) noexcept;
  // These of this account alone, without the parent.
  bool take_own(std::uint64_t bytes) noexcept;
  bool obtain_own(std::uint64_t bytes);
  void give_back_own(std::uint64_t bytes) noexcept;
  // `in_all`: with what the caller holds already.
  Error refusal(std::uint64_t bytes, const std::string& what, std::uint64_t in_all) const;

  MemoryAccount* const parent_ = nullptr;  // null: this is no share
  const std::string owner_ = {};           // of a share
  RoomMaker* const room_;
  mutable std::mutex mutex_;
  std::uint64_t limit_;
  std::uint64_t used_ = 0, peak_ = 0;
};

// Reservation of work whose memory is not known in advance: it grows before each allocation, with room made for it, and
// in the end split() hands over what was made. The rest is given back when it goes.
class GrowingReservation final : public MemoryLedger {
 public:
  explicit GrowingReservation(MemoryAccount& account) : account_(account) {}
  GrowingReservation(const GrowingReservation&) = delete;
  GrowingReservation& operator=(const GrowingReservation&) = delete;
  ~GrowingReservation() override { account_.give_back(held_); }

  bool grow(std::uint64_t bytes) noexcept override;
  void shrink(std::uint64_t bytes) noexcept override;
  std::uint64_t held() const override;
  Error refusal(std::uint64_t bytes, const std::string& what) const override;

  // Splits off `bytes` as a Reservation of their own; when less is held, the difference is reserved as by reserve().
  // Errors: as reserve().
  Result<Reservation> split(std::uint64_t bytes, const std::string& what);

 private:
  MemoryAccount& account_;
  mutable std::mutex mutex_;
  std::uint64_t held_ = 0;
};

}  // namespace helio
