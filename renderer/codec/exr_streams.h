// OpenEXR's C++ streams on memory. Internal to the codec.
#pragma once

#include <Iex.h>
#include <ImfIO.h>

#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace helio {

class MemoryWriter final : public Imf::OStream {
 public:
  explicit MemoryWriter(std::vector<std::uint8_t>& bytes) : OStream("memory"), bytes_(bytes) {}

  void write(const char data[], int size) override {
    const std::size_t end = position_ + std::size_t(size);
    if (end > bytes_.size()) bytes_.resize(end);
    std::memcpy(bytes_.data() + position_, data, std::size_t(size));
    position_ = end;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }

 private:
  std::vector<std::uint8_t>& bytes_;
  std::uint64_t position_ = 0;
};

class MemoryReader final : public Imf::IStream {
 public:
  explicit MemoryReader(std::span<const std::uint8_t> bytes) : IStream("memory"), bytes_(bytes) {}

  bool read(char data[], int size) override {
    if (size < 0 || position_ > bytes_.size() || std::uint64_t(size) > bytes_.size() - position_) {
      throw Iex::InputExc("unexpected end of the file");
    }
    std::memcpy(data, bytes_.data() + position_, std::size_t(size));
    position_ += std::uint64_t(size);
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::uint64_t position_ = 0;
};

}  // namespace helio
