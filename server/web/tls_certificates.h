// The certificate that the daemon shows and the authorities that it asks its callers' certificates from: files that may
// be replaced while it runs.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "renderer/base/result.h"

namespace helio {

struct TlsFiles {
  std::string certificate;  // the daemon's own first, then those that lead to its root
  std::string key;          // of that certificate, without a passphrase
  std::string client_ca;    // authorities of callers; empty: callers need no certificate
};

// What the files held when they fitted together.
struct TlsMaterial {
  std::string certificate, key, client_ca;  // PEM
  std::string notice;                       // for the log: the certificate is no longer valid, or not yet; else empty
  std::uint64_t version = 1;                // grows with each replacement
};

// Reads and checks them. invalid_argument names every option, file and problem: it cannot be read, is not PEM, wants a
// passphrase, the key is another certificate's. It never shows what a key file holds.
Result<TlsMaterial> read_tls_files(const TlsFiles& files);

// Thread safe.
class TlsCertificates {
 public:
  // Errors as of read_tls_files().
  static Result<std::shared_ptr<TlsCertificates>> open(const TlsFiles& files);

  // The newest that fit together. Looks for replaced files, at most once a second: to be called for each connection.
  std::shared_ptr<const TlsMaterial> current();
  // Looks now. Files that do not fit together are told in the log, once, and those before stay in force.
  void reload();
  bool asks_callers() const { return !files_.client_ca.empty(); }

 private:
  struct Stamp {
    std::int64_t seconds = -1, nanoseconds = 0;  // of the last change
    std::uint64_t inode = 0, bytes = 0;
    bool operator==(const Stamp&) const = default;
  };
  using Stamps = std::array<Stamp, 3>;

  TlsCertificates(TlsFiles files, TlsMaterial material, const Stamps& stamps);
  static Stamps stamps_of(const TlsFiles& files);
  void look(bool always);  // with mutex_ held

  const TlsFiles files_;
  std::mutex mutex_;
  std::shared_ptr<const TlsMaterial> material_;
  Stamps stamps_;  // of the files when they were read last, whether they fitted together or not
  double looked_s_ = 0;
};

}  // namespace helio
