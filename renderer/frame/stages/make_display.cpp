#include "renderer/frame/stages/make_display.h"

#include "renderer/frame/picture_state.h"

namespace helio {

void MakeDisplay::note(PictureState& picture) {
  if (layer_.known()) picture.state.displayed = picture.samples;
}

}  // namespace helio
