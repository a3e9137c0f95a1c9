#include "renderer/codec/pem_files.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <cstdint>
#include <memory>
#include <vector>

#include "renderer/codec/atomic_file.h"

namespace helio {
namespace {

constexpr std::uint64_t kMaxFile = 1 << 20;

struct Free {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};
template <class T>
using Owned = std::unique_ptr<T, Free>;

Owned<BIO> reader_of(const std::string& text) {
  return Owned<BIO>(BIO_new_mem_buf(text.data(), int(text.size())));
}

std::string read_text(const std::string& file, const std::string& where, Problems& problems) {
  const auto bytes = read_whole_file(file, kMaxFile);
  if (bytes) return {bytes->begin(), bytes->end()};
  problems.add(where, "'" + file + "' " + bytes.error().message + "; allowed: a file in PEM form");
  return {};
}

Owned<X509> first_certificate(const std::string& text) {
  return Owned<X509>(PEM_read_bio_X509(reader_of(text).get(), nullptr, nullptr, nullptr));
}

// Without it OpenSSL would ask at the terminal. `wanted`: a bool that is told.
int no_passphrase(char*, int, int, void* wanted) {
  *static_cast<bool*>(wanted) = true;
  return -1;
}

}  // namespace

std::string read_certificate_file(const std::string& file, const std::string& where, Problems& problems) {
  const std::size_t before = problems.size();
  std::string text = read_text(file, where, problems);
  if (problems.size() > before) return {};
  const Owned<BIO> reader = reader_of(text);
  int count = 0;
  ERR_clear_error();
  while (Owned<X509> certificate{PEM_read_bio_X509(reader.get(), nullptr, nullptr, nullptr)}) ++count;
  const unsigned long error = ERR_peek_last_error();
  const bool at_end = ERR_GET_LIB(error) == ERR_LIB_PEM && ERR_GET_REASON(error) == PEM_R_NO_START_LINE;
  ERR_clear_error();
  if (at_end && count > 0) return text;
  problems.add(where, at_end ? "'" + file + "' holds no certificate in PEM form (-----BEGIN CERTIFICATE-----)"
                             : "'" + file + "': certificate " + std::to_string(count + 1) + " in it is broken");
  return {};
}

std::string read_key_file(const std::string& file, const std::string& certificates, const std::string& certificate_file,
                          const std::string& where, Problems& problems) {
  const std::size_t before = problems.size();
  std::string text = read_text(file, where, problems);
  if (problems.size() > before) return {};
  bool passphrase = false;
  const Owned<EVP_PKEY> key(PEM_read_bio_PrivateKey(reader_of(text).get(), nullptr, no_passphrase, &passphrase));
  const Owned<X509> certificate = first_certificate(certificates);
  if (!key) {
    problems.add(where, passphrase ? "'" + file + "' wants a passphrase; allowed: a key without one"
                                   : "'" + file + "' holds no private key in PEM form");
  } else if (certificate && X509_check_private_key(certificate.get(), key.get()) != 1) {
    problems.add(where, "'" + file + "' is not the key of the first certificate in '" + certificate_file + "'");
  }
  ERR_clear_error();
  return problems.size() > before ? std::string() : text;
}

std::string validity_problem(const std::string& certificates) {
  const Owned<X509> certificate = first_certificate(certificates);
  ERR_clear_error();
  if (!certificate) return {};
  if (X509_cmp_current_time(X509_get0_notAfter(certificate.get())) < 0) return "has expired";
  if (X509_cmp_current_time(X509_get0_notBefore(certificate.get())) > 0) return "is not valid yet";
  return {};
}

}  // namespace helio
