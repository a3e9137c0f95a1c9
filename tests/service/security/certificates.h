// Certificates of a test's own, made when it runs: no key is kept anywhere.
#pragma once

#include <memory>
#include <string>

struct evp_pkey_st;
struct x509_st;

namespace helio::test {

struct Issued {
  std::string certificate, key;  // PEM
};

// A certificate authority, trusted by whoever is told to.
class Authority {
 public:
  explicit Authority(const std::string& name);

  std::string certificate() const;  // PEM

  struct Wish {
    std::string names = "DNS:localhost,IP:127.0.0.1";  // as openssl writes subjectAltName
    int from_days = -1, to_days = 30;                  // of validity, from now
  };
  Issued issue(const std::string& name, const Wish& wish) const;
  Issued issue(const std::string& name) const { return issue(name, Wish()); }

 private:
  std::shared_ptr<evp_pkey_st> key_;
  std::shared_ptr<x509_st> certificate_;
};

// The key of an Issued, encrypted.
std::string with_passphrase(const std::string& key);

}  // namespace helio::test
