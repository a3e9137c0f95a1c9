// What lights and images the scene has: light_features() and texture_features() of scene/light_tables.h and
// scene/texture_tables.h. Compilers leave out the code for the rest.
#ifndef LIGHT_FEATURES_GLSL
#define LIGHT_FEATURES_GLSL

layout(constant_id = 2) const uint kLightFeatures = 0xffffffffu;
bool has_light_feature(uint features) {
  return (kLightFeatures & features) != 0;
}

#endif
