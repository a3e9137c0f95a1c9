// The weights of all bidirectional techniques, by recursion along the two subpaths.
//
// A path of k segments can be made in k + 2 ways: s of its vertices, counted from the light, by a light path, the other
// t by a camera path, joined by one connection. The power heuristic with exponent 2 (Veach 1997, eq. 9.13) weights the
// one that did by 1 / (1 + sum over the others of (p_other / p)^2); of that sum what lies on either side of the
// connection is carried along its subpath in two numbers (van Antwerpen 2011, "A Survey of Importance Sampling
// Applications in Unbiased Physically Based Rendering"; Georgiev 2012, "Implementing Vertex Connection and Merging",
// eqs. 31 to 36, whose names these are). They are doubles: squares of densities up to 1e30 over distances down to 1e-6.
//
// Densities by which vertices are reached are in area measure; what turns them is the geometric cosine. Roulette and
// chance decisions at surfaces with alpha do not enter: they would in all techniques alike. Delta scattering has the
// density 1 both ways.
//
// How often a technique tries is part of its density (TechniqueCounts). Merging, where a light path arrives within a
// small disc about a camera vertex, is a technique like the others: that of a connection to the light vertex before, if
// the light path goes on into the disc (Georgiev 2012, eq. 8). It adds a term at every vertex where it could have been.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace helio {

// (p_other / p)^2. 0 / 0 and the like, where neither could have made the path, count nothing.
inline double mis_ratio(double other, double own) {
  const double ratio = other / own;
  return ratio > 0 ? ratio * ratio : 0;
}

// How often techniques try to make a path, for each camera path of a pixel; all others try once.
struct TechniqueCounts {
  double light_paths = 1;  // t = 1: a light path of the whole picture is one try for every pixel
  double connections = 1;  // s > 1, t > 1: of a camera vertex to light vertices of one depth, on average
  double merging = 0;      // light paths of the whole picture x area of the disc that they are merged in; 0: none
};

// What next-event estimation's density has that emission's has not: of a solid angle, the cosine that makes it one over
// the light; of a point that was chosen outright, the squared distance by which its flux thins out; of an infinite
// light nothing.
inline double light_measure(double distance, bool delta, double cos_light) {
  if (!std::isfinite(distance)) return 1;
  return delta ? distance * distance : cos_light;
}

struct MisState {
  double vcm = 0;  // of the techniques that connect the vertex before this one to what comes next on the other side
  double vc = 0;   // of all others further back on this subpath
  // Of a light path: of those among the above that the path tracer has, s = 0 and s = 1. At the first vertex that is
  // all of vcm and vc.
  double path_tracer = 0;
  bool first = true;  // nothing has been scattered yet

  // A camera path begins. `density` of its ray: per solid angle, in pixels.
  static MisState camera(double density, double light_paths) { return {mis_ratio(light_paths, density)}; }

  // A light path begins; `cos_light`: 1 where there is no surface. The density with which next-event estimation at the
  // first vertex would choose the same point of the light depends on that vertex: see arrive_from_light().
  static MisState light(double pdf_emission, double cos_light, bool delta) {
    return {0, delta ? 0 : mis_ratio(cos_light, pdf_emission)};
  }

  // The subpath's ray meets a surface. Rays of a directional light or camera arrive with the same density everywhere:
  // `finite` is false for their first vertex.
  void arrive(double distance, double cosine, bool finite) {
    const double squared = cosine_squared(cosine);
    if (finite) vcm *= distance * distance * distance * distance;
    vcm /= squared;
    vc /= squared;
    path_tracer /= squared;
  }

  // The light path's first: pdf_direct is the density (solid angle; delta lights: probability) with which next-event
  // estimation here would choose the point of the light where the path began.
  void arrive_from_light(double distance, double cosine, bool finite, bool delta, double pdf_direct,
                         double pdf_emission, double cos_light) {
    vc /= cosine_squared(cosine);
    const double measure = light_measure(finite ? distance : std::numeric_limits<double>::infinity(), delta, cos_light);
    vcm = mis_ratio(pdf_direct * measure, pdf_emission) / cosine_squared(cosine);
  }

  // The subpath goes on: densities of the direction it took and of the reverse one, cosine of the direction taken.
  void scatter(double pdf_forward, double pdf_reverse, double cosine, const TechniqueCounts& counts) {
    const double out = mis_ratio(cosine, pdf_forward);
    path_tracer = out * (first ? vc * pdf_reverse * pdf_reverse + vcm : path_tracer * pdf_reverse * pdf_reverse);
    vc = out * (vc * pdf_reverse * pdf_reverse + vcm + counts.merging * counts.merging);
    vcm = mis_ratio(counts.connections, pdf_forward);
    first = false;
  }
  void scatter_delta(double cosine) {
    path_tracer = (first ? vc : path_tracer) * cosine * cosine;
    vc *= cosine * cosine;
    vcm = 0;
    first = false;
  }
  // By a delta that light coming the other way would not take: no technique reaches behind it.
  void scatter_one_way() {
    vc = vcm = path_tracer = 0;
    first = false;
  }

  // Rays that arrive along a surface have no area density; the square of what they get is no infinity.
  static double cosine_squared(double cosine) { return std::max(cosine * cosine, 1e-24); }

  // The sum over the techniques further back on this subpath, relative to joining it here to something that arrives
  // with the area density `pdf_area` and leaves towards the previous vertex with `pdf_reverse`; `merging` as in
  // TechniqueCounts, that at this vertex included.
  double behind(double pdf_area, double pdf_reverse, double merging) const {
    return pdf_area * pdf_area * (vcm + merging * merging + vc * pdf_reverse * pdf_reverse);
  }
  // The same of a light path over the path tracer's techniques alone.
  double path_tracer_behind(double pdf_area, double pdf_reverse) const {
    if (first) return behind(pdf_area, pdf_reverse, 0);
    return pdf_area * pdf_area * path_tracer * pdf_reverse * pdf_reverse;
  }
};

// s = 0: a camera path hits a light. pdf_direct: next-event estimation at the vertex before, in area measure
// (environment: solid angle).
inline double weight_of_hit(const MisState& camera, double pdf_direct, double pdf_emission,
                            const TechniqueCounts& counts) {
  // vcm counts the connections that the vertex before would have had; it has one light sample.
  const double one = pdf_direct / counts.connections;
  const double others = one * one * camera.vcm + pdf_emission * pdf_emission * camera.vc;
  return 1 / (1 + others);
}

// s = 1: next-event estimation. pdf_direct as LightSample::pdf_w, distance infinite for lights that are so;
// pdf_forward, pdf_reverse: the camera vertex's densities of the direction to the light and from there back.
inline double weight_of_light_sample(const MisState& camera, double pdf_direct, double pdf_emission, bool delta,
                                     double distance, double cos_light, double cosine, double pdf_forward,
                                     double pdf_reverse, const TechniqueCounts& counts) {
  const double hit = delta ? 0 : mis_ratio(pdf_forward, pdf_direct);
  // 0: a light seen exactly edge-on, whose light paths do not start that way.
  const double direct = pdf_direct * light_measure(distance, delta, cos_light);
  const double pdf_area = direct > 0 ? pdf_emission * cosine / direct : 0;
  return 1 / (1 + hit + camera.behind(pdf_area, pdf_reverse, counts.merging));
}

// s > 1, t > 1: two vertices are joined. pdf_to_*: area density with which the other subpath, going on, would reach
// this vertex; pdf_reverse_*: with which this subpath's end would then be left towards the vertex before it.
inline double weight_of_connection(const MisState& camera, const MisState& light, double pdf_to_camera,
                                   double pdf_reverse_camera, double pdf_to_light, double pdf_reverse_light,
                                   const TechniqueCounts& counts) {
  const double others = camera.behind(pdf_to_camera, pdf_reverse_camera, counts.merging) +
                        light.behind(pdf_to_light, pdf_reverse_light, counts.merging);
  return 1 / (1 + others / (counts.connections * counts.connections));
}

// t = 1: a light path is joined to the camera. pdf_camera: area density of the camera's ray there, in pixels.
inline double weight_of_splat(const MisState& light, double pdf_camera, double pdf_reverse,
                              const TechniqueCounts& counts) {
  return 1 / (1 + light.behind(pdf_camera / counts.light_paths, pdf_reverse, counts.merging));
}

// A light path arrives within the disc about a camera vertex. pdf_reverse_*: with which the camera vertex is left
// towards the vertex before it on the same subpath, coming from that of the other. counts.merging > 0.
inline double weight_of_merging(const MisState& camera, const MisState& light, double pdf_reverse_camera,
                                double pdf_reverse_light, const TechniqueCounts& counts) {
  const double others = camera.vcm + camera.vc * pdf_reverse_camera * pdf_reverse_camera + light.vcm +
                        light.vc * pdf_reverse_light * pdf_reverse_light;
  return 1 / (1 + others / (counts.merging * counts.merging));
}

// Of light that the path tracer cannot find at all: as if it were found once in so many tries.
inline constexpr double kTriesToNever = 1e6;

// What a rare find adds to the mean square of a sample, beyond that of one as bright as `rare`: each technique's own.
struct RareSquares {
  double path = 0, bdpt = 0;
  RareSquares operator*(double times) const { return {path * times, bdpt * times}; }
};

// Of a path that some technique of bdpt has found, brighter than `rare` as either technique would have it. The path
// tracer's is what it would make of the path, times what that brought: the mean over all finds is its mean square (the
// change of measure of Grittmann et al. 2022, eq. 11). `radiance` is what it brought, weighted by `weight`; `ratio`:
// the sum of (p_j / p)^2 over the path tracer's two techniques j, p being the technique's own density, number of tries
// included. What the path tracer cannot find at all (a point light's caustic) is no noise of its picture, but missing
// from it (kTriesToNever).
inline RareSquares rare_squares(double radiance, double weight, double ratio, double rare) {
  if (!(weight > 0)) return {};
  const auto beyond = [&](double found) { return found > rare ? radiance * (found - rare * (rare / found)) : 0; };
  return {beyond(ratio > 0 ? radiance / (weight * std::sqrt(ratio)) : kTriesToNever * radiance), beyond(radiance)};
}

// Pictures of such squares are kept in units of this: their finds are relative to the picture, however bright it is.
inline double unit_of_squares(double rare) {
  return rare > 0 ? 0x1p20 * rare * rare : 1;
}

}  // namespace helio
