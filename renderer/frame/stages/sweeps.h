// Hands out work that goes over the film several times: all parts of a sweep, in any order, before the next begins.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>

namespace helio {

// Work has
//   std::size_t parts() const, int sweeps() const
//   void run(int sweep, std::size_t part)   thread safe for different parts of one sweep
//   void finish_sweep(int sweep)            after every part of it
template <class Work>
struct SweepPiece {
  std::shared_ptr<Work> work;
  int sweep = 0;
  std::size_t part = 0;
};

// Not thread safe: the owner's lock guards it.
template <class Work>
class SweepPass {
 public:
  // Null: nothing is to be done.
  void begin(std::shared_ptr<Work> work) {
    work_ = std::move(work);
    sweep_ = 0;
    next_ = done_ = 0;
    finish_empty_sweeps();
  }
  std::optional<SweepPiece<Work>> next() {
    if (!any_open()) return std::nullopt;
    return SweepPiece<Work>{work_, sweep_, next_++};
  }
  bool any_open() const { return work_ && next_ < work_->parts(); }
  void finish(const SweepPiece<Work>& piece) {
    if (piece.work != work_) return;  // stopped meanwhile
    if (++done_ < work_->parts()) return;
    work_->finish_sweep(sweep_++);
    finish_empty_sweeps();
    done_ = 0;
    next_ = sweep_ < work_->sweeps() ? 0 : work_->parts();
  }
  void stop() { work_.reset(); }
  // Nothing was begun, or all of it is done.
  bool finished() const { return !work_ || sweep_ == work_->sweeps(); }
  // Null: nothing was begun, or it was stopped.
  const Work* work() const { return work_.get(); }

 private:
  void finish_empty_sweeps() {
    while (work_ && sweep_ < work_->sweeps() && work_->parts() == 0) work_->finish_sweep(sweep_++);
  }

  std::shared_ptr<Work> work_;
  int sweep_ = 0;
  std::size_t next_ = 0, done_ = 0;  // parts of the sweep
};

// Thread safe for pieces of one sweep.
template <class Work>
void run_sweep(const SweepPiece<Work>& piece) {
  piece.work->run(piece.sweep, piece.part);
}

}  // namespace helio
