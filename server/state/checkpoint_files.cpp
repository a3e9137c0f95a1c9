#include "server/state/checkpoint_files.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <system_error>

#include "renderer/codec/atomic_file.h"
#include "renderer/codec/checksum.h"
#include "server/base/guarded.h"

namespace helio {
namespace {

namespace fs = std::filesystem;

constexpr std::array<char, 8> kMagic = {'H', 'e', 'l', 'i', 'o', 'C', 'k', 'p'};
constexpr std::uint32_t kVersion = 1;
// Of the body, for one CRC-32 each.
constexpr std::uint64_t kPiece = 1 << 20;
constexpr std::uint64_t kMaxHeader = 16 << 20;
constexpr std::size_t kMaxJobId = 128;
constexpr const char* kEndings[] = {".a", ".b"};

// What a file begins with, in the bytes of little-endian machines. Behind it: job id, header, a CRC-32 for each piece
// of the body, a CRC-32 of all that comes before it; then the body.
struct Start {
  std::array<char, 8> magic = kMagic;
  std::uint32_t version = kVersion;
  std::uint32_t job_id_bytes = 0;
  std::uint64_t number = 0;
  std::uint64_t header_bytes = 0;
  std::uint64_t body_bytes = 0;

  std::uint64_t pieces() const { return (body_bytes + kPiece - 1) / kPiece; }
  std::uint64_t head_bytes() const {
    return sizeof(Start) + job_id_bytes + header_bytes + (pieces() + 1) * sizeof(std::uint32_t);
  }
};
static_assert(sizeof(Start) == 40 && std::endian::native == std::endian::little);

using Bytes = std::span<const std::uint8_t>;

template <class T>
void append(std::vector<std::uint8_t>& bytes, const T* values, std::size_t count) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(values);
  bytes.insert(bytes.end(), begin, begin + count * sizeof(T));
}

// CRC-32 of every piece of the bytes, as if they lay one behind the other.
std::vector<std::uint32_t> checksums(std::span<const Bytes> parts, std::uint64_t pieces) {
  std::vector<std::uint32_t> sums;
  sums.reserve(std::size_t(pieces));
  std::uint32_t sum = 0;
  std::uint64_t have = 0;  // of the piece
  for (Bytes part : parts) {
    while (!part.empty()) {
      const std::size_t taken = std::size_t(std::min<std::uint64_t>(kPiece - have, part.size()));
      sum = crc32_of(part.data(), taken, sum);
      have += taken;
      part = part.subspan(taken);
      if (have < kPiece) continue;
      sums.push_back(sum);
      sum = 0;
      have = 0;
    }
  }
  if (have > 0) sums.push_back(sum);
  return sums;
}

bool fits_a_file_name(const std::string& job_id) {
  return !job_id.empty() && job_id.size() <= kMaxJobId && std::all_of(job_id.begin(), job_id.end(), [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' || c == '_';
  });
}

// A file of a job, opened. Every member says in its Error what is wrong with the file, which is then of no use.
class Reader {
 public:
  // not_found: there is none.
  static Result<Reader> open(const std::string& file) {
    Reader reader;
    reader.stream_.open(file, std::ios::binary);
    std::error_code unknown;
    if (!reader.stream_) {
      const bool there = fs::exists(file, unknown);
      return Error{there ? ErrorCode::internal : ErrorCode::not_found, "cannot be opened", file};
    }
    reader.file_ = file;
    reader.bytes_ = fs::file_size(file, unknown);
    if (unknown) return reader.error("has no size: " + unknown.message());
    return reader;
  }

  // All before the body.
  Status read_head(const std::string& job_id) {
    if (bytes_ < sizeof(Start)) return error(fmt::format("has {} bytes, fewer than any checkpoint", bytes_));
    if (!read(&start_, sizeof(start_))) return error("cannot be read");
    if (start_.magic != kMagic) return error("does not begin as a checkpoint");
    if (start_.version != kVersion) {
      return error(fmt::format("has version {}; this program reads version {}", start_.version, kVersion));
    }
    if (start_.job_id_bytes > kMaxJobId || start_.header_bytes > kMaxHeader || start_.body_bytes > bytes_ ||
        start_.head_bytes() + start_.body_bytes != bytes_) {
      return error(fmt::format("has {} bytes, other than its beginning says: it is cut or damaged", bytes_));
    }
    std::vector<std::uint8_t> head(std::size_t(start_.head_bytes()));
    std::memcpy(head.data(), &start_, sizeof(start_));
    if (!read(head.data() + sizeof(start_), head.size() - sizeof(start_))) return error("cannot be read");
    std::uint32_t sum = 0;
    const std::size_t summed = head.size() - sizeof(sum);
    std::memcpy(&sum, head.data() + summed, sizeof(sum));
    if (sum != crc32_of(head.data(), summed)) return error("is damaged before its body: its checksum is another");
    const char* text = reinterpret_cast<const char*>(head.data()) + sizeof(start_);
    if (std::string_view(text, start_.job_id_bytes) != job_id) {
      return error("is a checkpoint of job '" + std::string(text, start_.job_id_bytes) + "'");
    }
    header_.assign(text + start_.job_id_bytes, std::size_t(start_.header_bytes));
    sums_.resize(std::size_t(start_.pieces()));
    const char* sums = text + start_.job_id_bytes + start_.header_bytes;
    if (!sums_.empty()) std::memcpy(sums_.data(), sums, sums_.size() * sizeof(sum));
    return ok_status();
  }

  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t number() const { return start_.number; }
  const std::string& header() const { return header_; }  // after read_head()

  // After read_head().
  Result<CheckpointFile> read_body() {
    CheckpointFile checkpoint{start_.number, std::move(header_), {}};
    checkpoint.body.resize(std::size_t(start_.body_bytes));
    for (std::size_t piece = 0; piece < sums_.size(); ++piece) {
      std::uint8_t* begin = checkpoint.body.data() + piece * kPiece;
      const std::size_t size = std::size_t(std::min(kPiece, start_.body_bytes - piece * kPiece));
      if (!read(begin, size)) return error(fmt::format("cannot be read from byte {} of its body on", piece * kPiece));
      if (crc32_of(begin, size) != sums_[piece]) {
        return error(fmt::format("is damaged in the {} bytes from byte {} of its body on: their checksum is another",
                                 size, piece * kPiece));
      }
    }
    return checkpoint;
  }

  Error error(std::string message) const { return {ErrorCode::internal, std::move(message), file_}; }

 private:
  bool read(void* to, std::size_t size) {
    return bool(stream_.read(static_cast<char*>(to), std::streamsize(size)));
  }

  std::ifstream stream_;
  std::string file_;
  std::uint64_t bytes_ = 0;
  Start start_;
  std::string header_;
  std::vector<std::uint32_t> sums_;
};

}  // namespace

std::string CheckpointFiles::file(const std::string& job_id, int slot) const {
  return folder_ + "/" + job_id + kEndings[slot];
}

Status CheckpointFiles::open() {
  std::error_code failed;
  fs::create_directories(folder_, failed);
  if (failed) return Error{ErrorCode::unavailable, "cannot be made: " + failed.message(), folder_};
  for (fs::directory_iterator entry(folder_, failed), end; !failed && entry != end; entry.increment(failed)) {
    std::error_code ignored;
    if (entry->path().filename().string().find(".tmp-") != std::string::npos) fs::remove(entry->path(), ignored);
  }
  if (failed) return Error{ErrorCode::unavailable, "cannot be read: " + failed.message(), folder_};
  return ok_status();
}

Status CheckpointFiles::write(const std::string& job_id, const std::string& header, std::span<const Bytes> body) {
  if (!fits_a_file_name(job_id)) {
    return Error{ErrorCode::invalid_argument,
                 fmt::format("'{}'; allowed: 1 to {} letters, digits, '-' and '_'", job_id.substr(0, kMaxJobId),
                             kMaxJobId),
                 "job_id"};
  }
  HELIO_CHECK(header.size() <= kMaxHeader);
  // The numbers of the files that are there, and the slot of the newest.
  Start start;
  int newest = -1;
  std::uint64_t newest_number = 0;
  for (const int slot : {0, 1}) {
    auto reader = Reader::open(file(job_id, slot));
    if (!reader || !reader->read_head(job_id).ok()) continue;
    if (newest < 0 || reader->number() > newest_number) {
      newest = slot;
      newest_number = reader->number();
    }
  }
  start.number = newest_number + 1;
  {
    // Which of them is whole is known when it was written or read by this process.
    const std::lock_guard lock(mutex_);
    if (const auto known = newest_.find(job_id); known != newest_.end()) newest = known->second;
  }
  const int slot = newest == 0 ? 1 : 0;

  start.job_id_bytes = std::uint32_t(job_id.size());
  start.header_bytes = header.size();
  for (const Bytes& part : body) start.body_bytes += part.size();
  const std::vector<std::uint32_t> sums = checksums(body, start.pieces());
  std::vector<std::uint8_t> head;
  head.reserve(std::size_t(start.head_bytes()));
  append(head, &start, 1);
  append(head, job_id.data(), job_id.size());
  append(head, header.data(), header.size());
  append(head, sums.data(), sums.size());
  const std::uint32_t sum = crc32_of(head.data(), head.size());
  append(head, &sum, 1);

  std::vector<Bytes> parts;
  parts.reserve(body.size() + 1);
  parts.emplace_back(head);
  parts.insert(parts.end(), body.begin(), body.end());
  if (const Status written = write_parts_atomically(file(job_id, slot), parts); !written.ok()) return written;
  const std::lock_guard lock(mutex_);
  newest_[job_id] = slot;
  return ok_status();
}

CheckpointFiles::Newest CheckpointFiles::read(const std::string& job_id, std::uint64_t max_bytes) const {
  return read_before(job_id, ~std::uint64_t(0), max_bytes);
}

CheckpointFiles::Newest CheckpointFiles::look(const std::string& job_id, std::uint64_t max_bytes) const {
  return find(job_id, ~std::uint64_t(0), max_bytes, /*note=*/false);
}

CheckpointFiles::Newest CheckpointFiles::read_before(const std::string& job_id, std::uint64_t number,
                                                     std::uint64_t max_bytes) const {
  return find(job_id, number, max_bytes, /*note=*/true);
}

// note: the file that is found is known to be whole from then on.
CheckpointFiles::Newest CheckpointFiles::find(const std::string& job_id, std::uint64_t number,
                                              std::uint64_t max_bytes, bool note) const {
  Newest newest;
  if (!fits_a_file_name(job_id)) return newest;
  struct Candidate {
    Reader reader;
    int slot;
  };
  std::vector<Candidate> candidates;
  const auto refuse = [&](const Error& error) { newest.damaged.push_back(error.to_string()); };
  for (const int slot : {0, 1}) {
    auto reader = Reader::open(file(job_id, slot));
    if (!reader) {
      if (reader.error().code != ErrorCode::not_found) refuse(reader.error());
      continue;
    }
    if (reader->bytes() > max_bytes) {
      refuse(reader->error(fmt::format("has {} bytes; allowed: at most {}", reader->bytes(), max_bytes)));
    } else if (const Status head = guarded([&] { return reader->read_head(job_id); }); !head.ok()) {
      refuse(head.error());
    } else if (reader->number() < number) {
      candidates.push_back({std::move(*reader), slot});
    }
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.reader.number() > b.reader.number(); });
  for (Candidate& candidate : candidates) {
    auto body = guarded([&] { return candidate.reader.read_body(); });
    if (!body) {
      refuse(body.error());
      continue;
    }
    newest.file = std::move(*body);
    if (!note) break;
    const std::lock_guard lock(mutex_);
    newest_[job_id] = candidate.slot;
    break;
  }
  return newest;
}

CheckpointFiles::Newest CheckpointFiles::read_head(const std::string& job_id) const {
  Newest newest;
  if (!fits_a_file_name(job_id)) return newest;
  for (const int slot : {0, 1}) {
    auto reader = Reader::open(file(job_id, slot));
    if (!reader && reader.error().code == ErrorCode::not_found) continue;
    const Status head = reader ? guarded([&] { return reader->read_head(job_id); }) : Status(reader.error());
    if (!head.ok()) {
      newest.damaged.push_back(head.error().to_string());
    } else if (!newest.file || newest.file->number < reader->number()) {
      newest.file = CheckpointFile{reader->number(), reader->header(), {}};
    }
  }
  return newest;
}

std::vector<std::string> CheckpointFiles::job_ids() const {
  std::set<std::string> ids;
  std::error_code failed;
  for (fs::directory_iterator entry(folder_, failed), end; !failed && entry != end; entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    const std::size_t dot = name.rfind('.');
    if (dot == std::string::npos || (name.substr(dot) != kEndings[0] && name.substr(dot) != kEndings[1])) continue;
    if (fits_a_file_name(name.substr(0, dot))) ids.insert(name.substr(0, dot));
  }
  return {ids.begin(), ids.end()};
}

void CheckpointFiles::remove(const std::string& job_id) {
  if (!fits_a_file_name(job_id)) return;
  std::error_code ignored;
  for (const int slot : {0, 1}) fs::remove(file(job_id, slot), ignored);
  const std::lock_guard lock(mutex_);
  newest_.erase(job_id);
}

}  // namespace helio
