#include "client/file_hash.h"

#include <openssl/evp.h>

#include <fstream>
#include <memory>
#include <vector>

namespace helio {

Result<FileHash> sha256_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::not_found, "cannot be opened", path};
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> digest(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  if (!digest || EVP_DigestInit_ex(digest.get(), EVP_sha256(), nullptr) != 1) {
    return Error{ErrorCode::internal, "SHA-256 is not available", path};
  }
  FileHash hash;
  std::vector<char> piece(1 << 20);
  while (file.read(piece.data(), static_cast<std::streamsize>(piece.size())) || file.gcount() > 0) {
    EVP_DigestUpdate(digest.get(), piece.data(), static_cast<std::size_t>(file.gcount()));
    hash.bytes += static_cast<std::uint64_t>(file.gcount());
  }
  if (!file.eof()) return Error{ErrorCode::internal, "reading failed", path};
  unsigned length = 0;
  EVP_DigestFinal_ex(digest.get(), hash.sha256.data(), &length);
  return hash;
}

}  // namespace helio
