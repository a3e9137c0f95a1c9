// Small copies of many pictures of one size in one PNG: rows of them, each row in the middle.
#pragma once

#include <string>
#include <vector>

#include "renderer/base/picture_view.h"
#include "renderer/base/result.h"

namespace helio::cli {

class ContactSheet {
 public:
  // Of pictures of width x height pixels, shrunk by whole factors to at most 192x192.
  ContactSheet(int width, int height);

  // To the right end of a row; rows are made as they are named. `label` is drawn into a corner: digits and commas.
  void add(int row, std::string label, const PictureView& picture);

  // By row: auto_exposure() of the sum of its pictures.
  std::vector<double> exposures() const;

  // `exposures` by row.
  Status write(const std::string& path, const std::vector<double>& exposures) const;

 private:
  struct Copy {
    std::string label;
    std::vector<float> channels[3];
  };
  int factor_;
  int width_, height_;  // of a copy
  std::vector<std::vector<Copy>> rows_;
};

}  // namespace helio::cli
