#include "server/web/tls_certificates.h"

#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include <utility>

#include "renderer/base/clock.h"
#include "renderer/codec/pem_files.h"

namespace helio {
namespace {

constexpr double kLookSeconds = 1;

}  // namespace

Result<TlsMaterial> read_tls_files(const TlsFiles& files) {
  Problems problems;
  if (files.certificate.empty()) problems.add("tls-certificate", "is missing beside the other files of TLS");
  if (files.key.empty()) problems.add("tls-key", "is missing: the file with the certificate's key");
  if (!problems.empty()) return problems.to_error();

  TlsMaterial material;
  material.certificate = read_certificate_file(files.certificate, "tls-certificate", problems);
  material.key = read_key_file(files.key, material.certificate, files.certificate, "tls-key", problems);
  if (!files.client_ca.empty()) material.client_ca = read_certificate_file(files.client_ca, "tls-client-ca", problems);
  if (!problems.empty()) return problems.to_error();
  const std::string invalid = validity_problem(material.certificate);
  if (!invalid.empty())
    material.notice = "the certificate in '" + files.certificate + "' " + invalid + ": clients refuse it";
  return material;
}

Result<std::shared_ptr<TlsCertificates>> TlsCertificates::open(const TlsFiles& files) {
  const Stamps stamps = stamps_of(files);  // before they are read: a later change is seen
  auto material = read_tls_files(files);
  if (!material) return material.error();
  if (!material->notice.empty()) spdlog::warn("{}", material->notice);
  return std::shared_ptr<TlsCertificates>(new TlsCertificates(files, std::move(*material), stamps));
}

TlsCertificates::TlsCertificates(TlsFiles files, TlsMaterial material, const Stamps& stamps)
    : files_(std::move(files)),
      material_(std::make_shared<const TlsMaterial>(std::move(material))),
      stamps_(stamps),
      looked_s_(now_s()) {}

TlsCertificates::Stamps TlsCertificates::stamps_of(const TlsFiles& files) {
  Stamps stamps;
  const std::string* const names[] = {&files.certificate, &files.key, &files.client_ca};
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    struct stat info {};
    if (names[i]->empty() || stat(names[i]->c_str(), &info) != 0) continue;
    stamps[i] = {info.st_mtim.tv_sec, info.st_mtim.tv_nsec, info.st_ino, std::uint64_t(info.st_size)};
  }
  return stamps;
}

std::shared_ptr<const TlsMaterial> TlsCertificates::current() {
  const std::lock_guard lock(mutex_);
  if (now_s() - looked_s_ >= kLookSeconds) look(false);
  return material_;
}

void TlsCertificates::reload() {
  const std::lock_guard lock(mutex_);
  look(true);
}

// Two files are replaced one after the other: in between they do not fit together, and what was before goes on.
void TlsCertificates::look(bool always) {
  looked_s_ = now_s();
  const Stamps stamps = stamps_of(files_);
  if (!always && stamps == stamps_) return;
  stamps_ = stamps;
  auto material = read_tls_files(files_);
  if (!material) return spdlog::error("the files of TLS are left as they were: {}", material.error().to_string());
  if (material->certificate == material_->certificate && material->key == material_->key &&
      material->client_ca == material_->client_ca)
    return;
  if (!material->notice.empty()) spdlog::warn("{}", material->notice);
  material->version = material_->version + 1;
  material_ = std::make_shared<const TlsMaterial>(std::move(*material));
  spdlog::info("the files of TLS were read again, connections from now on get what they hold");
}

}  // namespace helio
