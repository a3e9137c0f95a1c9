#include "tests/support/tev_receiver.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "renderer/base/clock.h"

namespace helio::test {

namespace {

constexpr std::uint32_t kLargestPacket = 256 << 20;

}  // namespace

const std::vector<float>& TevReceivedImage::plane(const std::string& channel) const {
  static const std::vector<float> kNone;
  const auto found = std::find(channels.begin(), channels.end(), channel);
  EXPECT_NE(found, channels.end()) << channel;
  return found == channels.end() ? kNone : planes[std::size_t(found - channels.begin())];
}

TevReceiver::TevReceiver(int port, int receive_buffer) {
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  name.sin_port = htons(std::uint16_t(port));
  listen_at(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), &name, sizeof name, receive_buffer);
  socklen_t size = sizeof name;
  getsockname(listener_, reinterpret_cast<sockaddr*>(&name), &size);
  port_ = ntohs(name.sin_port);
}

TevReceiver::TevReceiver(const std::string& path) : path_(path) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::strncpy(name.sun_path, path.c_str(), sizeof name.sun_path - 1);
  listen_at(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0), &name, sizeof name, 0);
}

void TevReceiver::listen_at(int descriptor, const void* address, std::size_t size, int receive_buffer) {
  listener_ = descriptor;
  const int on = 1;
  setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (receive_buffer > 0) setsockopt(listener_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
  wake_ = eventfd(0, EFD_CLOEXEC);
  if (listener_ < 0 || wake_ < 0 || bind(listener_, static_cast<const sockaddr*>(address), socklen_t(size)) != 0 ||
      listen(listener_, 8) != 0)
    throw std::runtime_error("no socket for the receiver");
  thread_ = std::thread([this] { run(); });
}

TevReceiver::~TevReceiver() {
  stop();
  close(wake_);
}

std::string TevReceiver::address() const {
  return path_.empty() ? "127.0.0.1:" + std::to_string(port_) : "unix:" + path_;
}

void TevReceiver::read(bool on) {
  const std::lock_guard lock(mutex_);
  reading_ = on;
  eventfd_write(wake_, 1);
}

void TevReceiver::cut() {
  std::unique_lock lock(mutex_);
  cutting_ = true;
  eventfd_write(wake_, 1);
  changed_.wait(lock, [&] { return !cutting_ || stopping_; });
}

void TevReceiver::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    eventfd_write(wake_, 1);
  }
  if (thread_.joinable()) thread_.join();
  if (listener_ >= 0) close(std::exchange(listener_, -1));
}

bool TevReceiver::wait_for(const std::function<bool(const Images&)>& wanted, double seconds) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return wanted(images_); });
}

TevReceiver::Images TevReceiver::images() const {
  const std::lock_guard lock(mutex_);
  return images_;
}

std::vector<std::string> TevReceiver::errors() const {
  const std::lock_guard lock(mutex_);
  return errors_;
}

int TevReceiver::connections() const {
  const std::lock_guard lock(mutex_);
  return connections_;
}

void TevReceiver::run() {
  struct Connection {
    int descriptor;
    std::string pending;
    bool open = true;
  };
  std::vector<Connection> open;
  const auto close_all = [&] {
    for (const Connection& connection : open) close(connection.descriptor);
    open.clear();
  };
  for (;;) {
    bool reading = false;
    {
      const std::lock_guard lock(mutex_);
      if (std::exchange(cutting_, false)) close_all();
      changed_.notify_all();
      if (stopping_) break;
      reading = reading_;
    }
    std::vector<pollfd> wanted{{wake_, POLLIN, 0}, {listener_, POLLIN, 0}};
    for (const Connection& connection : open) wanted.push_back({reading ? connection.descriptor : -1, POLLIN, 0});
    if (poll(wanted.data(), wanted.size(), -1) < 0) continue;
    if (wanted[0].revents != 0) {
      eventfd_t ignored = 0;
      eventfd_read(wake_, &ignored);
    }
    for (std::size_t i = 0; reading && i < open.size(); ++i) {
      if (wanted[i + 2].revents != 0) read_from(open[i].descriptor, open[i].pending, open[i].open);
    }
    std::erase_if(open, [](const Connection& connection) {
      if (!connection.open) close(connection.descriptor);
      return !connection.open;
    });
    if (wanted[1].revents != 0) {
      const int descriptor = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      if (descriptor >= 0) open.push_back({descriptor, {}});
      const std::lock_guard lock(mutex_);
      connections_ += descriptor >= 0;
    }
  }
  close_all();
}

void TevReceiver::read_from(int descriptor, std::string& pending, bool& open) {
  static thread_local std::vector<char> buffer(1 << 20);
  const ssize_t got = recv(descriptor, buffer.data(), buffer.size(), MSG_DONTWAIT);
  open = got > 0;
  if (got <= 0) return;
  pending.append(buffer.data(), std::size_t(got));
  std::size_t at = 0;
  for (std::uint32_t length = 0; pending.size() - at >= sizeof length; at += length) {
    std::memcpy(&length, pending.data() + at, sizeof length);
    if (length < sizeof length + 1 || length > kLargestPacket) {
      const std::lock_guard lock(mutex_);
      errors_.push_back("a packet of " + std::to_string(length) + " bytes");
      open = false;
      return;
    }
    if (pending.size() - at < length) break;
    const auto packet = read_tev_packet(std::string_view(pending).substr(at, length));
    const std::lock_guard lock(mutex_);
    if (packet) {
      take(*packet);
    } else {
      errors_.push_back(packet.error().to_string());
    }
    changed_.notify_all();
  }
  pending.erase(0, at);
}

void TevReceiver::take(const TevPacket& packet) {
  if (packet.type == TevPacket::Type::create) {
    TevReceivedImage& image = images_[packet.name];
    const int created = image.created + 1;
    image = {};
    image.created = created;
    image.width = packet.width;
    image.height = packet.height;
    image.channels = packet.channels;
    image.grabbed = packet.grab_focus;
    image.planes.assign(image.channels.size(), std::vector<float>(std::size_t(image.width) * std::size_t(image.height),
                                                                  std::numeric_limits<float>::quiet_NaN()));
    return;
  }
  if (packet.type == TevPacket::Type::close) {
    images_.erase(packet.name);
    return;
  }
  if (packet.type != TevPacket::Type::update && packet.type != TevPacket::Type::vector_graphics) return;
  const auto found = images_.find(packet.name);
  if (found == images_.end()) {
    errors_.push_back("there is no image '" + packet.name + "'");
    return;
  }
  TevReceivedImage& image = found->second;
  if (packet.type == TevPacket::Type::vector_graphics) {
    if (!packet.append) image.drawn.clear();
    image.drawn.insert(image.drawn.end(), packet.commands.begin(), packet.commands.end());
    ++image.drawings;
    if (!packet.commands.empty()) image.drawn_with_s.push_back(now_s());
    return;
  }
  if (packet.x + packet.width > image.width || packet.y + packet.height > image.height) {
    errors_.push_back("pixels outside of the image '" + packet.name + "'");
    return;
  }
  ++image.updates;
  for (std::size_t c = 0; c < packet.channels.size(); ++c) {
    const auto channel = std::find(image.channels.begin(), image.channels.end(), packet.channels[c]);
    if (channel == image.channels.end()) {
      errors_.push_back("'" + packet.name + "' has no channel '" + packet.channels[c] + "'");
      continue;
    }
    std::vector<float>& plane = image.planes[std::size_t(channel - image.channels.begin())];
    for (int y = 0; y < packet.height; ++y) {
      std::copy_n(packet.planes[c].begin() + std::ptrdiff_t(y) * packet.width, packet.width,
                  plane.begin() + std::ptrdiff_t(packet.y + y) * image.width + packet.x);
    }
  }
}

}  // namespace helio::test
