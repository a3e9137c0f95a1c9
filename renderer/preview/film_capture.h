// The light of the film at which the camera rested becomes what previews look up: radiance over the colour of the
// surface, with as many samples as the film has; filtered for the eye where the film is shown so.
#pragma once

#include "renderer/film/core/film.h"
#include "renderer/film/display/display_layer.h"
#include "renderer/preview/preview_history.h"

namespace helio {

// Pixels of a window of history.rest, from the film and from history.last, whose surfaces and colours are of the film's
// view. Pixels in which the film has few samples keep the preview's light by its share. Thread safe for different
// windows. display: of the film; null: has none.
void capture_film(const Film& film, const DisplayLayer* display, const PixelRect& window, PreviewHistory& history);

}  // namespace helio
