"""A drawing and plans in the form of public files: features, tolerances, datums."""

from __future__ import annotations

DMIS_PLAN = """DMISMN/'plan',05.2
UNITS/MM,ANGDEC
F(TOP)=FEAT/PLANE,CART,0,0,20,0,0,1
F(HOLE1)=FEAT/CYLNDR,INNER,CART,$
12,12,10,0,0,1,12,20
F(RING)=FEAT/CIRCLE,OUTER,CART,40,14,26,0,0,2,14
F(P1)=FEAT/POINT,CART,0,0,0,0,0,1
F(SLIT)=FEAT/CPARLN,INNER,ROUND,CART,0,0,0,0,0,1,1,0,0,10,4
DATDEF/FA(TOP),DAT(A)
DATDEF/FA(HOLE1),DAT(D)
T(D1)=TOL/DIAM,-0.01,0.02
T(POS1)=TOL/POS,2D,0.1,MMC,DAT(A)
T(POS2)=TOL/POS,2D,0.2,RFS,DAT(A),DAT(D),MMC
T(POS3)=TOL/POS,2D,0.3
T(FL)=TOL/FLAT,0.02
T(COR)=TOL/CORTOL,XAXIS,-0.1,0.1
MEAS/CYLNDR,F(HOLE1),4
ENDMES
OUTPUT/FA(HOLE1),TA(D1),TA(POS1)
OUTPUT/FA(RING),TA(POS2),TA(COR)
OUTPUT/FA(RING),TA(POS3)
OUTPUT/FA(TOP),TA(FL)
ENDFIL
"""
QIF_PLAN = """<?xml version="1.0"?>
<QIFDocument xmlns="http://qifstandards.org/xsd/qif3" versionQIF="3.0.0" idMax="99">
<FileUnits><PrimaryUnits><LinearUnit><UnitName>inch</UnitName></LinearUnit></PrimaryUnits></FileUnits>
<DatumDefinitions n="2">
 <DatumDefinition id="1"><DatumLabel>A</DatumLabel>
  <FeatureNominalIds n="1"><Id>11</Id></FeatureNominalIds></DatumDefinition>
 <DatumDefinition id="2"><DatumLabel>B</DatumLabel></DatumDefinition>
</DatumDefinitions>
<DatumReferenceFrames n="1"><DatumReferenceFrame id="3"><Datums n="2">
 <Datum><SimpleDatum><DatumDefinitionId>2</DatumDefinitionId>
  <MaterialModifier>MAXIMUM</MaterialModifier></SimpleDatum>
  <Precedence><PrecedenceEnum>SECONDARY</PrecedenceEnum></Precedence></Datum>
 <Datum><SimpleDatum><DatumDefinitionId>1</DatumDefinitionId>
  <MaterialModifier>NONE</MaterialModifier></SimpleDatum>
  <Precedence><PrecedenceEnum>PRIMARY</PrecedenceEnum></Precedence></Datum>
</Datums></DatumReferenceFrame></DatumReferenceFrames>
<Features>
<FeatureDefinitions n="2"><PlaneFeatureDefinition id="10"/>
 <CylinderFeatureDefinition id="20"><InternalExternal>INTERNAL</InternalExternal>
  <Diameter>0.5</Diameter></CylinderFeatureDefinition></FeatureDefinitions>
<FeatureNominals n="3">
 <PlaneFeatureNominal id="11"><FeatureDefinitionId>10</FeatureDefinitionId>
  <Location>0 0 1</Location><Normal>0 0 1</Normal></PlaneFeatureNominal>
 <CylinderFeatureNominal id="21"><FeatureDefinitionId>20</FeatureDefinitionId>
  <Axis><AxisPoint>1 2 0</AxisPoint><Direction>0 0 1</Direction></Axis>
  </CylinderFeatureNominal>
 <CylinderFeatureNominal id="31"><FeatureDefinitionId>20</FeatureDefinitionId>
  <Axis><AxisPoint>3 2 0</AxisPoint><Direction>0 0 1</Direction></Axis>
  </CylinderFeatureNominal>
</FeatureNominals>
<FeatureItems n="3">
 <PlaneFeatureItem id="12">
  <FeatureNominalId>11</FeatureNominalId>
  <FeatureName>TOP</FeatureName>
  </PlaneFeatureItem>
 <CylinderFeatureItem id="22">
  <FeatureNominalId>21</FeatureNominalId>
  <FeatureName>DATUM_B</FeatureName>
  </CylinderFeatureItem>
 <CylinderFeatureItem id="32">
  <FeatureNominalId>31</FeatureNominalId>
  <FeatureName>HOLE</FeatureName>
  </CylinderFeatureItem>
</FeatureItems></Features>
<Characteristics>
<CharacteristicDefinitions n="3">
 <FlatnessCharacteristicDefinition id="40">
  <ToleranceValue>0.001</ToleranceValue>
  </FlatnessCharacteristicDefinition>
 <DiameterCharacteristicDefinition id="41">
  <Tolerance><MaxValue>0.002</MaxValue>
  <MinValue>-0.001</MinValue>
  <DefinedAsLimit>false</DefinedAsLimit></Tolerance></DiameterCharacteristicDefinition>
 <PositionCharacteristicDefinition id="42"><ToleranceValue>0.01</ToleranceValue>
  <MaterialCondition>MAXIMUM</MaterialCondition><DatumReferenceFrameId>3</DatumReferenceFrameId>
 </PositionCharacteristicDefinition>
 <ThreadCharacteristicDefinition id="43"/>
</CharacteristicDefinitions>
<CharacteristicNominals n="4">
 <FlatnessCharacteristicNominal id="50">
  <CharacteristicDefinitionId>40</CharacteristicDefinitionId>
  </FlatnessCharacteristicNominal>
 <DiameterCharacteristicNominal id="51">
  <CharacteristicDefinitionId>41</CharacteristicDefinitionId>
  </DiameterCharacteristicNominal>
 <PositionCharacteristicNominal id="52">
  <CharacteristicDefinitionId>42</CharacteristicDefinitionId>
  </PositionCharacteristicNominal>
 <ThreadCharacteristicNominal id="53">
  <CharacteristicDefinitionId>43</CharacteristicDefinitionId>
  </ThreadCharacteristicNominal>
</CharacteristicNominals>
<CharacteristicItems n="4">
 <FlatnessCharacteristicItem id="60"><CharacteristicNominalId>50</CharacteristicNominalId>
  <FeatureItemIds n="1"><Id>12</Id></FeatureItemIds></FlatnessCharacteristicItem>
 <DiameterCharacteristicItem id="61"><CharacteristicNominalId>51</CharacteristicNominalId>
  <FeatureItemIds n="2"><Id>22</Id><Id>32</Id></FeatureItemIds></DiameterCharacteristicItem>
 <PositionCharacteristicItem id="62"><CharacteristicNominalId>52</CharacteristicNominalId>
  <FeatureItemIds n="1"><Id>32</Id></FeatureItemIds></PositionCharacteristicItem>
 <ThreadCharacteristicItem id="63"><CharacteristicNominalId>53</CharacteristicNominalId>
  <FeatureItemIds n="1"><Id>32</Id></FeatureItemIds></ThreadCharacteristicItem>
</CharacteristicItems></Characteristics></QIFDocument>
"""
DRAWING = """
[[feature]]
label = "A"
kind = "plane"
select = "plane3-*"
[[feature]]
label = "B"
kind = "plane"
select = "plane2-*"
[[feature]]
label = "D"
kind = "cylinder"
select = "bore1-*"
tolerance = "11.99..12.03"
  [[feature.geometric]]
  kind = "position"
  tolerance_mm = 0.05
  datums = ["A", "B"]
  material = "M"
[[feature]]
label = "E"
kind = "cylinder"
select = "bore2-*"
  [[feature.geometric]]
  kind = "position"
  tolerance_mm = 0.001
  datums = ["A", "D", "B"]
[[pattern]]
label = "bores"
features = ["D", "E"]
position_tolerance_mm = 0.05
datums = ["A"]
[[between]]
features = ["D", "E"]
nominal = 53.0377
tolerance = "±0.02"
"""
