// The pictures that modes are compared with, kept from one comparison to the next within a limit of bytes.
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "renderer/comparison/picture_errors.h"
#include "server/base/memory_account.h"
#include "server/compare/picture_collector.h"
#include "server/sessions/idle_room.h"

namespace helio {

struct ReferencePicture {
  std::string id;
  Picture mean;
  std::optional<Picture> half_a, half_b;  // both or none
  std::optional<Picture> variance;        // of the mean; not beside halves
  std::uint32_t samples = 0;              // per pixel; 0: not known
  std::optional<double> error;            // reference_error()
  Reservation memory;

  ReferenceView view() const;
};

// Bytes of so many pictures of this size.
std::uint64_t picture_bytes(int width, int height, int pictures);

// Thread safe.
class ReferenceStore final : public SpareMemory {
 public:
  ReferenceStore(std::uint64_t limit, MemoryAccount& memory) : limit_(limit), memory_(memory) {}

  // Null: not there.
  std::shared_ptr<const ReferencePicture> find(const std::string& id);
  // It was there once and was let go since.
  bool was_let_go(const std::string& id) const;
  // Kept until others need its place, those least recently used going first. One larger than the limit is not kept.
  void keep(std::shared_ptr<const ReferencePicture> reference);

  // Of an EXR file with R, G and B and, where it has them, variance.R, variance.G and variance.B, named by its hash;
  // the one that is there if it is. invalid_argument: no such file, a value that is not finite, a negative variance.
  // resource_exhausted: max_reference_memory, max_memory.
  Result<std::shared_ptr<const ReferencePicture>> load(std::span<const std::uint8_t> exr, const std::string& sha256);

  // Of those that no comparison uses.
  bool free_some() override;
  std::uint64_t could_free() const override;

  std::uint64_t limit() const { return limit_; }
  MemoryAccount& memory() const { return memory_; }  // that references count on

 private:
  using Kept = std::list<std::shared_ptr<const ReferencePicture>>;
  void let_go(Kept::iterator kept, Kept& gone);  // with mutex_ held

  const std::uint64_t limit_;
  MemoryAccount& memory_;
  mutable std::mutex mutex_;
  Kept kept_;                       // the most recently used first
  std::deque<std::string> let_go_;  // the newest last, a bounded number
};

}  // namespace helio
