"""Renders a case of `cargo xtask bench volumes` with one of VTK's two volume mappers.

    python vtk_render.py CASE.json OUT --mapper fixed|opengl --frames N

OUT.f32 holds the picture as raw little-endian float32, height x width x 3 values, the top row first: display values in
0 to 1 over black, to which no gamma was ever applied. OUT.json holds the seconds of every frame but the first, their
median, that of the CPU seconds, and what rendered.

`fixed` is vtkFixedPointVolumeRayCastMapper; its picture is the 15-bit one that it casts, as VTK resamples it by up to
half a pixel on its way to the window. `opengl` is vtkOpenGLGPUVolumeRayCastMapper; its picture is the window's, of
8 bits. The window is EGL's without a surface (Debian: libegl1, libgl1-mesa-dri), on a machine without a GPU Mesa's
llvmpipe. Nothing adapts to the speed: one ray a pixel, a sample every step from entry to exit, no jitter.

A case has, lengths in voxels' edges and voxel (i, j, k) at the point (i, j, k):

    voxels      a file beside the case, of bytes, x fastest; both 0 and 255 occur
    dims, size  of the volume; width and height of the picture in pixels
    camera      position, target, up, fov (degrees, vertical)
    transfer    [value, opacity over one edge, [r, g, b]]..., opacity and colour linear in between
    step        between samples
    shading     null, or direction (in which the light travels), ambient, diffuse, specular, power (Blinn-Phong);
                two_sided (both sides of surfaces are lit)
"""

import argparse
import ctypes
import json
import os
import statistics
import time

import numpy as np
import vtk
from vtk.util import numpy_support


def image(case, folder):
    """The voxels."""
    voxels = np.fromfile(os.path.join(folder, case["voxels"]), dtype=np.uint8)
    if voxels.size != np.prod(case["dims"]):
        raise SystemExit(f"{case['voxels']} has {voxels.size} voxels, not {case['dims']}")
    if voxels.min() != 0 or voxels.max() != 255:
        raise SystemExit("the voxels must go from 0 to 255, over which VTK stretches its tables")
    result = vtk.vtkImageData()
    result.SetDimensions(case["dims"])
    result.GetPointData().SetScalars(numpy_support.numpy_to_vtk(voxels, deep=True))
    return result


def appearance(case, mapper):
    """The transfer function and the material."""
    opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    for value, alpha, rgb in case["transfer"]:
        opacity.AddPoint(value, alpha)
        colour.AddRGBPoint(value, *rgb)
    result = vtk.vtkVolumeProperty()
    result.SetScalarOpacity(opacity)
    result.SetScalarOpacityUnitDistance(1.0)
    result.SetColor(colour)
    result.SetInterpolationTypeToLinear()
    result.DisableGradientOpacityOn()
    if case["shading"]:
        result.ShadeOn()
        result.SetAmbient(case["shading"]["ambient"])
        result.SetDiffuse(case["shading"]["diffuse"])
        result.SetSpecular(case["shading"]["specular"])
        # One mapper has Blinn's highlight, the other Phong's, which is as wide at a quarter of the power.
        result.SetSpecularPower(case["shading"]["power"] / (4 if mapper == "opengl" else 1))
    return result


def camera(case):
    """The camera. The fixed-point mapper's samples start at the near plane, so that it must not be VTK's choice."""
    result = vtk.vtkCamera()
    result.SetPosition(case["camera"]["position"])
    result.SetFocalPoint(case["camera"]["target"])
    result.SetViewUp(case["camera"]["up"])
    result.SetViewAngle(case["camera"]["fov"])
    result.SetClippingRange(0.1 * result.GetDistance(), 10.0 * result.GetDistance())
    return result


def light(direction):
    """A directional light, fixed in the world."""
    result = vtk.vtkLight()
    result.SetLightTypeToSceneLight()
    result.PositionalOff()
    result.SetPosition([-x for x in direction])
    result.SetFocalPoint(0, 0, 0)
    result.SetColor(1, 1, 1)
    # By default no light is ambient; the fixed-point mapper multiplies its ambient term by this.
    result.SetAmbientColor(1, 1, 1)
    return result


def mapper_of(kind, case):
    """The mapper, with all that adapts to speed switched off."""
    if kind == "fixed":
        result = vtk.vtkFixedPointVolumeRayCastMapper()
        result.IntermixIntersectingGeometryOff()
    else:
        result = vtk.vtkOpenGLGPUVolumeRayCastMapper()
        result.UseJitteringOff()
    result.SetBlendModeToComposite()
    result.AutoAdjustSampleDistancesOff()
    result.LockSampleDistanceToInputSpacingOff()
    result.SetImageSampleDistance(1.0)
    result.SetSampleDistance(case["step"])
    return result


def cast(mapper, size):
    """The picture that the fixed-point mapper cast, in which 32767 is 1 and the bottom row is first."""
    of = mapper.GetRayCastImage()
    memory, used, origin = of.GetImageMemorySize(), of.GetImageInUseSize(), of.GetImageOrigin()
    # VTK wraps a bare pointer as "_<hexadecimal address>_p_void".
    address = int(of.GetImage().split("_")[1], 16)
    values = (ctypes.c_uint16 * (memory[0] * memory[1] * 4)).from_address(address)
    values = np.frombuffer(values, dtype=np.uint16).reshape(memory[1], memory[0], 4)
    result = np.zeros((size[1], size[0], 3), np.float32)
    result[origin[1] : origin[1] + used[1], origin[0] : origin[0] + used[0]] = values[: used[1], : used[0], :3]
    return result / 32767.0


def window_picture(window, size):
    """The window's picture, the bottom row first."""
    pixels = vtk.vtkUnsignedCharArray()
    window.GetRGBACharPixelData(0, 0, size[0] - 1, size[1] - 1, 0, pixels)
    return numpy_support.vtk_to_numpy(pixels).reshape(size[1], size[0], 4)[..., :3].astype(np.float32) / 255.0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("case")
    parser.add_argument("out")
    parser.add_argument("--mapper", choices=["fixed", "opengl"], required=True)
    parser.add_argument("--frames", type=int, required=True)
    arguments = parser.parse_args()
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    with open(arguments.case) as file:
        case = json.load(file)

    mapper = mapper_of(arguments.mapper, case)
    mapper.SetInputData(image(case, os.path.dirname(arguments.case)))
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(appearance(case, arguments.mapper))
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(0, 0, 0)
    renderer.SetActiveCamera(camera(case))
    renderer.AutomaticLightCreationOff()
    renderer.SetTwoSidedLighting(bool(case["shading"] and case["shading"].get("two_sided")))
    if case["shading"]:
        renderer.AddLight(light(case["shading"]["direction"]))
        if arguments.mapper == "opengl":
            # This mapper's ambient term has no colour where the light is not the default headlight; the other's has.
            coloured = "finalColor.rgb += in_ambient[0] * (color.rgb - vec3(1.0));"
            shader = volume.GetShaderProperty()
            shader.AddFragmentShaderReplacement("//VTK::ComputeLighting::Exit", False, coloured, False)
    renderer.AddVolume(volume)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(case["size"])
    window.AddRenderer(renderer)

    seconds, cpu = [], []
    for _ in range(arguments.frames + 1):
        begun, spent = time.perf_counter(), time.process_time()
        window.Render()
        window.WaitForCompletion()
        seconds.append(time.perf_counter() - begun)
        cpu.append(time.process_time() - spent)
    picture = cast(mapper, case["size"]) if arguments.mapper == "fixed" else window_picture(window, case["size"])
    np.ascontiguousarray(picture[::-1], dtype="<f4").tofile(arguments.out + ".f32")
    capabilities = window.ReportCapabilities().splitlines()
    report = {
        "seconds": seconds[1:],
        "cpu_seconds": statistics.median(cpu[1:]),
        "median": statistics.median(seconds[1:]),
        "first": seconds[0],
        "mapper": mapper.GetClassName(),
        "window": window.GetClassName(),
        "opengl": next((line.split(":", 1)[1].strip() for line in capabilities if "renderer string" in line), ""),
        "version": vtk.vtkVersion.GetVTKVersion(),
    }
    with open(arguments.out + ".json", "w") as file:
        json.dump(report, file)


if __name__ == "__main__":
    main()
