// Work in numbered parts, shared out to threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <future>
#include <vector>

namespace helio {

// Calls work(next) on up to `threads` threads, this one among them; next() gives the next part, each of 0 to count - 1
// to one thread, then `count` for ever. Returns when all have returned, and throws what one of them threw.
template <class Work>
void share_out(int count, int threads, const Work& work) {
  std::atomic<int> parts{0};
  const auto next = [&] { return std::min(parts++, count); };
  std::vector<std::future<void>> others;
  for (int i = 1; i < std::min(threads, count); ++i)
    others.push_back(std::async(std::launch::async, [&] { work(next); }));
  work(next);
  for (auto& other : others) other.get();
}

}  // namespace helio
