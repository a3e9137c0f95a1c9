// images, samplers, textures and textureInfo.
#include "renderer/scene/gltf/document/textures.h"

namespace helio::gltf {

namespace {

WrapMode read_wrap(const JsonObject& object, const char* key) {
  const std::uint64_t value = object.count(key, 10497);
  switch (value) {
    case 10497:
      return WrapMode::repeat;
    case 33071:
      return WrapMode::clamp;
    case 33648:
      return WrapMode::mirror;
    default:
      object.diagnostics().fail(object.place() / key, "is " + std::to_string(value) + ", allowed: 10497, 33071, 33648");
      return WrapMode::repeat;
  }
}

void read_images(const JsonObject& root, Document& document) {
  root.each("images", [&](const JsonObject& object, std::size_t i) {
    Diagnostics& diagnostics = object.diagnostics();
    object.only({"uri", "mimeType", "bufferView"});
    document.extensions.check(object, Site::elsewhere);
    ImageSource image;
    image.mime_type = object.string("mimeType");
    image.view = object.reference("bufferView", document.views.size(), "bufferViews");
    if (object.has("uri")) image.uri = object.string("uri");
    if (image.uri.has_value() == object.has("bufferView"))
      diagnostics.fail(object.place(), "needs exactly one of uri and bufferView");
    // The bytes of an image say what it is.
    if (object.has("bufferView") && !object.has("mimeType"))
      diagnostics.tolerate(object.place() / "bufferView", "needs mimeType beside it", "the image's bytes decide");
    if (object.has("mimeType") && image.mime_type != "image/png" && image.mime_type != "image/jpeg" &&
        !(image.mime_type == "image/webp" && document.extensions.used("EXT_texture_webp")) &&
        !(image.mime_type == "image/ktx2" && document.extensions.used("KHR_texture_basisu"))) {
      diagnostics.tolerate(object.place() / "mimeType",
                           "is \"" + image.mime_type.substr(0, 60) + "\", allowed: image/png, image/jpeg",
                           "the image's bytes decide");
      image.mime_type.clear();
    }
    const bool short_uri = image.uri && image.uri->size() < 200 && !image.uri->starts_with("data:");
    image.name = short_uri ? *image.uri : "image " + std::to_string(i);
    document.images.push_back(std::move(image));
  });
}

void read_samplers(const JsonObject& root, Document& document) {
  root.each("samplers", [&](const JsonObject& object, std::size_t) {
    object.only({"magFilter", "minFilter", "wrapS", "wrapT"});
    document.extensions.check(object, Site::elsewhere);
    Sampler sampler;
    sampler.wrap_u = read_wrap(object, "wrapS");
    sampler.wrap_v = read_wrap(object, "wrapT");
    std::uint64_t mag = object.count("magFilter", 9729);
    const std::uint64_t min = object.count("minFilter", 9729);
    if (mag >= 9984 && mag <= 9987) {  // filters with mip maps, which only minification has; the even ones are nearest
      object.diagnostics().tolerate(object.place() / "magFilter",
                                    "is " + std::to_string(mag) + ", allowed: 9728, 9729",
                                    mag % 2 == 0 ? "read as 9728" : "read as 9729");
      mag = mag % 2 == 0 ? 9728 : 9729;
    } else if (mag != 9728 && mag != 9729) {
      object.diagnostics().fail(object.place() / "magFilter", "is " + std::to_string(mag) + ", allowed: 9728, 9729");
    }
    if (min != 9728 && min != 9729 && (min < 9984 || min > 9987))
      object.diagnostics().fail(object.place() / "minFilter",
                                "is " + std::to_string(min) + ", allowed: 9728, 9729, 9984 to 9987");
    // A path tracer looks textures up at full resolution: the magnification filter is the one that shows.
    sampler.filter = mag == 9728 ? FilterMode::nearest : FilterMode::bilinear;
    document.samplers.push_back(sampler);
  });
}

}  // namespace

void read_textures(const JsonObject& root, Document& document) {
  read_images(root, document);
  read_samplers(root, document);
  root.each("textures", [&](const JsonObject& object, std::size_t) {
    object.only({"sampler", "source"});
    document.extensions.check(object, Site::texture);
    Texture texture;
    texture.sampler = object.reference("sampler", document.samplers.size(), "samplers");
    texture.source = object.reference("source", document.images.size(), "images");
    for (const char* name : {"EXT_texture_webp", "KHR_texture_basisu"}) {
      const JsonObject alternative = object.extension(name);
      if (!alternative.exists()) continue;
      alternative.only({"source"});
      alternative.reference("source", document.images.size(), "images");
      if (texture.source < 0)
        object.diagnostics().warn(object.place(), std::string("has its image in ") + name + " only: left out");
    }
    document.textures.push_back(texture);
  });
}

TextureSlot read_texture_slot(const JsonObject& owner, const char* key, TexelEncoding encoding,
                              const Document& document) {
  TextureSlot slot;
  slot.encoding = encoding;
  const JsonObject object = owner.object(key);
  if (!object.exists() || !object.require("index")) return slot;
  object.only({"index", "texCoord", "scale", "strength"});
  document.extensions.check(object, Site::texture_info);
  const int index = object.reference("index", document.textures.size(), "textures");
  std::uint64_t texcoord = object.count("texCoord", 0, 0, INT32_MAX);

  if (const JsonObject transform = object.extension("KHR_texture_transform"); transform.exists()) {
    transform.only({"offset", "rotation", "scale", "texCoord"});
    texcoord = transform.count("texCoord", texcoord, 0, INT32_MAX);
    const std::vector<double> offset = transform.numbers("offset", 2, 2), scale = transform.numbers("scale", 2, 2);
    const double angle = transform.number("rotation", 0);
    const double ox = offset.empty() ? 0 : offset[0], oy = offset.empty() ? 0 : offset[1];
    const double sx = scale.empty() ? 1 : scale[0], sy = scale.empty() ? 1 : scale[1];
    const double c = std::cos(angle), s = std::sin(angle);
    // translation * rotation * scale, as in the extension's README: counter-clockwise in a space whose v points down.
    slot.uv_transform = {float(c * sx), float(s * sy), float(ox), float(-s * sx), float(c * sy), float(oy)};
  }
  slot.texcoord = int(texcoord);
  if (index < 0) return slot;
  const Texture& texture = document.textures[std::size_t(index)];
  slot.image = texture.source;
  if (texture.sampler >= 0) {
    const Sampler& sampler = document.samplers[std::size_t(texture.sampler)];
    slot.wrap_u = sampler.wrap_u;
    slot.wrap_v = sampler.wrap_v;
    slot.filter = sampler.filter;
  }
  return slot;
}

}  // namespace helio::gltf
