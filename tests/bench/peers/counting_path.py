"""Mitsuba's path integrator with a count of its rays.

Its loop is compiled and tells nobody how many rays it traces. This one draws the same random numbers in the same order,
so that its picture is that of `path` at the same seed, which the caller checks; three more channels have the rays that
look for a surface, those that look for a light, and how many of these would bring light if nothing were in their way.
Import it after the variant is set.
"""
import drjit as dr
import mitsuba as mi


def power_heuristic(a, b):
    weight = dr.square(a) * dr.rcp(dr.square(a) + dr.square(b))
    return dr.select(dr.isfinite(weight), weight, 0)


class CountingPath(mi.SamplingIntegrator):
    def __init__(self, props):
        super().__init__(props)
        self.max_depth = props.get("max_depth", 10)
        self.rr_depth = props.get("rr_depth", 5)

    def aov_names(self):
        return ["segments", "shadow_rays", "useful_shadow_rays"]

    @dr.syntax
    def sample(self, scene, sampler, ray, medium=None, active=True):
        context = mi.BSDFContext()
        ray = mi.Ray3f(ray)
        active = mi.Bool(active)
        throughput, radiance = mi.Spectrum(1), mi.Spectrum(0)
        eta, depth = mi.Float(1), mi.UInt32(0)
        segments, shadow_rays, useful_rays = mi.Float(0), mi.Float(0), mi.Float(0)
        previous, previous_pdf, previous_delta = dr.zeros(mi.Interaction3f), mi.Float(1), mi.Bool(True)

        while active:
            # The next vertex.
            segments += 1
            si = scene.ray_intersect(ray, ray_flags=mi.RayFlags.All, coherent=depth == 0)

            # Emission, weighed against the light sample of the vertex before.
            hit = mi.DirectionSample3f(scene, si, previous)
            light_pdf = scene.pdf_emitter_direction(previous, hit, ~previous_delta)
            weight = power_heuristic(previous_pdf, light_pdf)
            radiance += throughput * weight * hit.emitter.eval(si, previous_pdf > 0)

            goes_on = (depth + 1 < self.max_depth) & si.is_valid()
            bsdf = si.bsdf(ray)

            # Direct light.
            lit = goes_on & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
            light, light_weight = scene.sample_emitter_direction(si, sampler.next_2d(), False, lit)
            lit &= light.pdf != 0
            shadow_rays += dr.select(lit, 1.0, 0.0)
            asked = mi.Bool(lit)
            lit &= ~scene.ray_test(si.spawn_ray_to(light.p), lit)
            to_light = si.to_local(light.d)
            choice, direction = sampler.next_1d(), sampler.next_2d()
            value, pdf, scattered, scattered_weight = bsdf.eval_pdf_sample(context, si, to_light, choice, direction)
            weight = dr.select(light.delta, 1, power_heuristic(light.pdf, pdf))
            brought = throughput * value * light_weight * weight
            useful_rays += dr.select(asked & (dr.max(brought) > 0), 1.0, 0.0)
            radiance[lit] += brought

            # The next direction.
            ray = si.spawn_ray(si.to_world(scattered.wo))
            throughput *= scattered_weight
            eta *= scattered.eta
            previous, previous_pdf = mi.Interaction3f(si), scattered.pdf
            previous_delta = mi.has_flag(scattered.sampled_type, mi.BSDFFlags.Delta)

            # Russian roulette.
            depth[si.is_valid()] += 1
            largest = dr.max(throughput)
            survival = dr.minimum(largest * dr.square(eta), 0.95)
            survives = sampler.next_1d() < survival
            played = depth >= self.rr_depth
            throughput[played] *= dr.rcp(survival)
            active &= goes_on & (~played | survives) & (largest != 0)

        return radiance, True, [segments, shadow_rays, useful_rays]


mi.register_integrator("counting_path", CountingPath)
