// Runs a fuzzer's function without libFuzzer: over its committed corpus, then over mutations of it that depend on their
// number alone. For any compiler, and the same on every machine.
//
// usage: helio_fuzz_short_NAME CORPUS MUTATIONS [FIRST]     (of these, numbers FIRST, FIRST + 1, ...; 0)
//        helio_fuzz_short_NAME FILE
// Exit code 0: nothing found. What ends the program names the input on stderr; a mutation's number, as FIRST with one
// mutation, repeats it.
#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "renderer/base/hash.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
// Where a sanitizer is linked.
extern "C" void __sanitizer_set_death_callback(void (*callback)()) __attribute__((weak));

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kMaxBytes = 4096;  // as in tests/fuzz/run

char current_input[512] = "";

void name_the_input() {
  std::fprintf(stderr, "short_run: the program ended in %s\n", current_input);
}

void on_signal(int signal) {
  name_the_input();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

void run(const Bytes& bytes, const std::string& name) {
  std::snprintf(current_input, sizeof current_input, "%s", name.c_str());
  // A copy of just this size, so that a sanitizer sees each byte that is read beyond it.
  const std::unique_ptr<std::uint8_t[]> copy(new std::uint8_t[bytes.size()]);
  std::copy(bytes.begin(), bytes.end(), copy.get());
  LLVMFuzzerTestOneInput(copy.get(), bytes.size());
}

// Uniform integers from a counter (SplitMix64, Steele et al. 2014).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15ull) {}
  std::uint64_t next() {
    return helio::hash64(state_ += 0x9e3779b97f4a7c15ull);
  }
  std::size_t below(std::size_t n) { return n == 0 ? 0 : std::size_t(next() % n); }

 private:
  std::uint64_t state_;
};

// What parsers stumble over: signs, limits, delimiters, numbers that are none.
const std::string kPieces[] = {
    "-1", "0",    "1e39", "1e308", "1e-320", "nan", "-0",   "4294967295", "18446744073709551616", "null", "[]",
    "{}", "\"\"", "../",  "%00",   "</",     "/>",  "<!--", "$x",         std::string(1, '\0'),   "\xff", "\xf0\x9f",
    std::string("\xff\xff\xff\xff", 4), std::string("\xff\xff\xff\x7f", 4), std::string("\0\0\0\x80", 4)};

void mutate_once(Bytes& bytes, const std::vector<Bytes>& corpus, Random& random) {
  const std::size_t at = random.below(bytes.size() + 1);
  const auto place = bytes.begin() + std::ptrdiff_t(at);
  const std::size_t length = std::min(bytes.size() - at, 1 + random.below(random.below(4) ? 8 : 256));
  switch (random.below(9)) {
    case 0:
      if (at < bytes.size()) bytes[at] ^= std::uint8_t(1u << random.below(8));
      break;
    case 1:
      if (at < bytes.size()) bytes[at] = std::uint8_t(random.next());
      break;
    case 2:
      if (at < bytes.size()) bytes[at] = std::uint8_t(bytes[at] + (random.below(2) ? 1 : 255));
      break;
    case 3:
      bytes.erase(place, place + std::ptrdiff_t(length));
      break;
    case 4: {
      const Bytes again(place, place + std::ptrdiff_t(length));
      bytes.insert(bytes.begin() + std::ptrdiff_t(random.below(bytes.size() + 1)), again.begin(), again.end());
      break;
    }
    case 5:
    case 6: {
      const std::string& piece = kPieces[random.below(std::size(kPieces))];
      const std::size_t over = random.below(2) ? std::min(piece.size(), bytes.size() - at) : 0;
      bytes.erase(place, place + std::ptrdiff_t(over));
      bytes.insert(bytes.begin() + std::ptrdiff_t(at), piece.begin(), piece.end());
      break;
    }
    case 7:
      bytes.resize(at);
      break;
    case 8: {
      const Bytes& other = corpus[random.below(corpus.size())];
      const std::size_t from = random.below(other.size());
      bytes.resize(at);
      bytes.insert(bytes.end(), other.begin() + std::ptrdiff_t(from), other.end());
      break;
    }
  }
}

Bytes mutation(std::uint64_t number, const std::vector<Bytes>& corpus) {
  Random random(number);
  Bytes bytes = corpus[random.below(corpus.size())];
  for (std::size_t steps = 1 + random.below(6); steps > 0; --steps) mutate_once(bytes, corpus, random);
  bytes.resize(std::min(bytes.size(), kMaxBytes));
  return bytes;
}

Bytes read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    std::fprintf(stderr, "short_run: cannot read %s\n", path.c_str());
    std::exit(2);
  }
  return {std::istreambuf_iterator<char>(file), {}};
}

std::uint64_t number(const char* text) {
  char* end = nullptr;
  const std::uint64_t value = std::strtoull(text, &end, 10);
  if (*text == '\0' || *end != '\0') {
    std::fprintf(stderr, "short_run: '%s' is no number; allowed: [0, 2^64)\n", text);
    std::exit(2);
  }
  return value;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 4) {
    std::fprintf(stderr, "usage: %s CORPUS MUTATIONS [FIRST]\n       %s FILE\n", argv[0], argv[0]);
    return 2;
  }
  std::signal(SIGABRT, on_signal);
  if (__sanitizer_set_death_callback) {
    __sanitizer_set_death_callback(name_the_input);
  } else {
    for (const int signal : {SIGSEGV, SIGFPE, SIGBUS, SIGILL}) std::signal(signal, on_signal);
  }
  if (argc == 2) {
    run(read(argv[1]), argv[1]);
    return 0;
  }
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(argv[1])) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<Bytes> corpus;
  for (const auto& path : paths) {
    corpus.push_back(read(path));
    run(corpus.back(), path.string());
  }
  if (corpus.empty()) {
    std::fprintf(stderr, "short_run: no file in %s\n", argv[1]);
    return 2;
  }
  const std::uint64_t count = number(argv[2]), first = argc > 3 ? number(argv[3]) : 0;
  for (std::uint64_t i = first; i < first + count; ++i) run(mutation(i, corpus), "mutation " + std::to_string(i));
  std::printf("%zu files and %llu mutations, no finding\n", corpus.size(), static_cast<unsigned long long>(count));
  return 0;
}
