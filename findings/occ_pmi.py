"""A box with tolerances in Open CASCADE's document: written as AP242 and read again."""

from pathlib import Path

from OCP.Bnd import Bnd_Box
from OCP.BRepBndLib import BRepBndLib
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.Interface import Interface_Static
from OCP.OCP.collections import Sequence_TDF_Label
from OCP.STEPCAFControl import STEPCAFControl_Reader, STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_StepModelType
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDimTolObjects import XCAFDimTolObjects_DimensionObject as Dimension
from OCP.XCAFDimTolObjects import XCAFDimTolObjects_DimensionType as Kind
from OCP.XCAFDimTolObjects import XCAFDimTolObjects_GeomToleranceObject as Tolerance
from OCP.XCAFDoc import XCAFDoc_Dimension, XCAFDoc_DocumentTool, XCAFDoc_GeomTolerance


def _document():
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    return document


def dimension(kind, value, *, upper=None, lower=None):
    """LinearDistance, Angular or Thickness, with deviations."""
    made = Dimension()
    prefix = "Size" if kind == "Thickness" else "Location"
    made.SetType(getattr(Kind, f"XCAFDimTolObjects_DimensionType_{prefix}_{kind}"))
    made.SetValue(value)
    if upper is not None:
        made.SetUpperTolValue(upper)
        made.SetLowerTolValue(lower)
    return made


def round_trip(path, dimensions=(), tolerances=(), unit="MM"):
    """Write and read dimensions and tolerances of a box of 30 x 20 x 10 mm.

    A dimension is between two faces, a thickness and a tolerance of one.

    Returns dimensions, tolerances and the solid that are read, and the text of the file.
    """
    document = _document()
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    box = BRepPrimAPI_MakeBox(30.0, 20.0, 10.0).Shape()
    label = shapes.AddShape(box, False)
    faces, explorer = [], TopExp_Explorer(box, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        faces.append(shapes.AddSubShape(label, explorer.Current()))
        explorer.Next()
    for each in dimensions:
        place = tool.AddDimension()
        XCAFDoc_Dimension.Set_s(place).SetObject(each)
        if each.GetType() == Kind.XCAFDimTolObjects_DimensionType_Size_Thickness:
            tool.SetDimension(faces[4], place)
        else:
            tool.SetDimension(faces[0], faces[1], place)
    for each in tolerances:
        place = tool.AddGeomTolerance()
        XCAFDoc_GeomTolerance.Set_s(place).SetObject(each)
        tool.SetGeomTolerance(faces[5], place)
    writer = STEPCAFControl_Writer()
    Interface_Static.SetCVal_s("write.step.schema", "AP242DIS")
    Interface_Static.SetCVal_s("write.step.unit", unit)
    writer.SetDimTolMode(True)
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(path)
    return (*read(path), Path(path).read_text())


def read(path):
    """Read dimensions, tolerances and the solid of a file."""
    document = _document()
    reader = STEPCAFControl_Reader()
    reader.SetGDTMode(True)
    reader.ReadFile(path)
    reader.Transfer(document)
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    dimensions = _listed(tool.GetDimensionLabels)
    tolerances = _listed(tool.GetGeomToleranceLabels)
    return (
        [XCAFDoc_Dimension.Set_s(label).GetObject() for label in dimensions],
        [XCAFDoc_GeomTolerance.Set_s(label).GetObject() for label in tolerances],
        shapes.GetShape_s(_listed(shapes.GetFreeShapes)[0]),
    )


def _listed(labels_of):
    labels = Sequence_TDF_Label()
    labels_of(labels)
    return [labels.Value(i + 1) for i in range(labels.Length())]


def length_of_x(shape):
    """The extent of a shape along x, in mm."""
    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    (low, *_), (high, *_) = (corner.Coord() for corner in (box.CornerMin(), box.CornerMax()))
    return high - low


__all__ = ["Tolerance", "dimension", "length_of_x", "read", "round_trip"]
