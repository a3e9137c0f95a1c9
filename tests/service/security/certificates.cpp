#include "security/certificates.h"

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <stdexcept>

namespace helio::test {
namespace {

using Key = std::shared_ptr<EVP_PKEY>;
using Certificate = std::shared_ptr<X509>;

Key make_key() {
  Key key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  if (!key) throw std::runtime_error("no key");
  return key;
}

template <class Write>
std::string to_pem(const Write& write) {
  const std::unique_ptr<BIO, int (*)(BIO*)> out(BIO_new(BIO_s_mem()), BIO_free);
  write(out.get());
  const char* text = nullptr;
  const long size = BIO_get_mem_data(out.get(), &text);
  return {text, std::size_t(size)};
}

std::string to_pem(const Key& key) {
  return to_pem([&](BIO* out) { PEM_write_bio_PrivateKey(out, key.get(), nullptr, nullptr, 0, nullptr, nullptr); });
}

std::string to_pem(const Certificate& certificate) {
  return to_pem([&](BIO* out) { PEM_write_bio_X509(out, certificate.get()); });
}

void add_extension(X509* certificate, X509* issuer, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
  if (!extension) throw std::runtime_error("no such extension: " + value);
  X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
}

// issuer: null, signed by its own key.
Certificate make_certificate(const std::string& name, const Key& key, X509* issuer, EVP_PKEY* signer,
                             const Authority::Wish& wish, bool authority) {
  Certificate certificate(X509_new(), X509_free);
  X509_set_version(certificate.get(), 2);  // 3, counted from 0
  std::uint32_t serial = 0;
  RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial);
  ASN1_INTEGER_set(X509_get_serialNumber(certificate.get()), long(serial >> 1));
  constexpr long kDay = 86400;
  X509_gmtime_adj(X509_getm_notBefore(certificate.get()), wish.from_days * kDay);
  X509_gmtime_adj(X509_getm_notAfter(certificate.get()), wish.to_days * kDay);
  X509_NAME* subject = X509_get_subject_name(certificate.get());
  X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, reinterpret_cast<const unsigned char*>(name.c_str()), -1, -1,
                             0);
  X509* const by = issuer ? issuer : certificate.get();
  X509_set_issuer_name(certificate.get(), X509_get_subject_name(by));
  X509_set_pubkey(certificate.get(), key.get());
  add_extension(certificate.get(), by, NID_basic_constraints, authority ? "critical,CA:TRUE" : "critical,CA:FALSE");
  if (!wish.names.empty() && !authority) add_extension(certificate.get(), by, NID_subject_alt_name, wish.names);
  if (X509_sign(certificate.get(), signer, EVP_sha256()) == 0) throw std::runtime_error("not signed");
  return certificate;
}

}  // namespace

Authority::Authority(const std::string& name) : key_(make_key()) {
  certificate_ = make_certificate(name, key_, nullptr, key_.get(), {}, true);
}

std::string Authority::certificate() const {
  return to_pem(certificate_);
}

Issued Authority::issue(const std::string& name, const Wish& wish) const {
  const Key key = make_key();
  return {to_pem(make_certificate(name, key, certificate_.get(), key_.get(), wish, false)), to_pem(key)};
}

std::string with_passphrase(const std::string& key) {
  const std::unique_ptr<BIO, int (*)(BIO*)> in(BIO_new_mem_buf(key.data(), int(key.size())), BIO_free);
  const Key read(PEM_read_bio_PrivateKey(in.get(), nullptr, nullptr, nullptr), EVP_PKEY_free);
  static unsigned char passphrase[] = "secret";
  return to_pem([&](BIO* out) {
    PEM_write_bio_PrivateKey(out, read.get(), EVP_aes_128_cbc(), passphrase, sizeof passphrase - 1, nullptr, nullptr);
  });
}

}  // namespace helio::test
