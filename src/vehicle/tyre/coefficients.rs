//! The coefficients of the Magic Formula 5.2, as `.tir` files hold them.

use crate::vehicle::parameters::parameters;

parameters! {
    /// A complete MF 5.2 coefficient set for combined slip with aligning moment. Names are Pacejka's; a `.tir` key is the name in
    /// capitals.
    ///
    /// Outside the bounds the formula has no meaning. Real tyres lie in much narrower ranges.
    pub struct TyreCoefficients {
        r0: "R0" ["m"] 0.05..=2.0, None, "unloaded radius";
        fnomin: "FNOMIN" ["N"] 10.0..=1000000.0, None, "nominal load";
        lfz0: "lFz0" ["-"] 0.01..=100.0, Some(1.0), "scale factor of nominal load";
        lcx: "lCx" ["-"] 0.01..=10.0, Some(1.0), "scale factor of Fx shape factor";
        lmux: "lMUx" ["-"] 0.01..=10.0, Some(1.0), "scale factor of Fx peak friction";
        lex: "lEx" ["-"] -100.0..=100.0, Some(1.0), "scale factor of Fx curvature";
        lkx: "lKx" ["-"] 0.01..=100.0, Some(1.0), "scale factor of Fx slip stiffness";
        lhx: "lHx" ["-"] -100.0..=100.0, Some(1.0), "scale factor of Fx horizontal shift";
        lvx: "lVx" ["-"] -100.0..=100.0, Some(1.0), "scale factor of Fx vertical shift";
        lgax: "lGAX" ["-"] -100.0..=100.0, Some(1.0), "scale factor of camber in Fx";
        lcy: "lCy" ["-"] 0.01..=10.0, Some(1.0), "scale factor of Fy shape factor";
        lmuy: "lMUy" ["-"] 0.01..=10.0, Some(1.0), "scale factor of Fy peak friction";
        ley: "lEy" ["-"] -100.0..=100.0, Some(1.0), "scale factor of Fy curvature";
        lky: "lKy" ["-"] 0.01..=100.0, Some(1.0), "scale factor of Fy cornering stiffness";
        lhy: "lHy" ["-"] -100.0..=100.0, Some(1.0), "scale factor of Fy horizontal shift";
        lvy: "lVy" ["-"] -100.0..=100.0, Some(1.0), "scale factor of Fy vertical shift";
        lgay: "lGAY" ["-"] -100.0..=100.0, Some(1.0), "scale factor of camber in Fy";
        ltr: "lTR" ["-"] -100.0..=100.0, Some(1.0), "scale factor of pneumatic trail";
        lres: "lRES" ["-"] -100.0..=100.0, Some(1.0), "scale factor of residual moment";
        lgaz: "lGAZ" ["-"] -100.0..=100.0, Some(1.0), "scale factor of camber in Mz";
        lxal: "lXAL" ["-"] -100.0..=100.0, Some(1.0), "scale factor of slip angle's influence on Fx";
        lyka: "lYKA" ["-"] -100.0..=100.0, Some(1.0), "scale factor of slip ratio's influence on Fy";
        lvyka: "lVYKA" ["-"] -100.0..=100.0, Some(1.0), "scale factor of slip-ratio-induced Fy";
        ls: "lS" ["-"] -100.0..=100.0, Some(1.0), "scale factor of the moment arm of Fx";
        pcx1: "pCx1" ["-"] 0.01..=5.0, None, "shape factor of Fx";
        pdx1: "pDx1" ["-"] -10.0..=10.0, None, "longitudinal friction at nominal load";
        pdx2: "pDx2" ["-"] -10.0..=10.0, Some(0.0), "variation of longitudinal friction with load";
        pdx3: "pDx3" ["1/rad2"] -1000.0..=1000.0, Some(0.0), "variation of longitudinal friction with camber";
        pex1: "pEx1" ["-"] -1000.0..=1000.0, Some(0.0), "curvature of Fx at nominal load";
        pex2: "pEx2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of Fx curvature with load";
        pex3: "pEx3" ["-"] -1000.0..=1000.0, Some(0.0), "variation of Fx curvature with load squared";
        pex4: "pEx4" ["-"] -1000.0..=1000.0, Some(0.0), "Fx curvature, driving against braking";
        pkx1: "pKx1" ["-"] -1000.0..=1000.0, None, "longitudinal slip stiffness per load";
        pkx2: "pKx2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of slip stiffness with load";
        pkx3: "pKx3" ["-"] -10.0..=10.0, Some(0.0), "exponent of slip stiffness in load";
        phx1: "pHx1" ["-"] -1.0..=1.0, Some(0.0), "horizontal shift of Fx";
        phx2: "pHx2" ["-"] -1.0..=1.0, Some(0.0), "variation of Fx horizontal shift with load";
        pvx1: "pVx1" ["-"] -10.0..=10.0, Some(0.0), "vertical shift of Fx per load";
        pvx2: "pVx2" ["-"] -10.0..=10.0, Some(0.0), "variation of Fx vertical shift with load";
        rbx1: "rBx1" ["-"] -1000.0..=1000.0, Some(0.0), "slope factor of combined slip Fx";
        rbx2: "rBx2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of combined Fx slope with slip ratio";
        rcx1: "rCx1" ["-"] -10.0..=10.0, Some(1.0), "shape factor of combined slip Fx";
        rex1: "rEx1" ["-"] -1000.0..=1000.0, Some(0.0), "curvature of combined slip Fx";
        rex2: "rEx2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of combined Fx curvature with load";
        rhx1: "rHx1" ["-"] -1.0..=1.0, Some(0.0), "shift of combined slip Fx";
        pcy1: "pCy1" ["-"] 0.01..=5.0, None, "shape factor of Fy";
        pdy1: "pDy1" ["-"] -10.0..=10.0, None, "lateral friction at nominal load";
        pdy2: "pDy2" ["-"] -10.0..=10.0, Some(0.0), "variation of lateral friction with load";
        pdy3: "pDy3" ["-"] -1000.0..=1000.0, Some(0.0), "variation of lateral friction with camber squared";
        pey1: "pEy1" ["-"] -1000.0..=1000.0, Some(0.0), "curvature of Fy at nominal load";
        pey2: "pEy2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of Fy curvature with load";
        pey3: "pEy3" ["-"] -1000.0..=1000.0, Some(0.0), "Fy curvature, left against right";
        pey4: "pEy4" ["-"] -10000.0..=10000.0, Some(0.0), "variation of Fy curvature with camber";
        pky1: "pKy1" ["-"] -1000.0..=1000.0, None, "greatest cornering stiffness per nominal load, negative in these axes";
        pky2: "pKy2" ["-"] -100.0..=100.0, None, "load at greatest cornering stiffness per nominal load";
        pky3: "pKy3" ["-"] -100.0..=100.0, Some(0.0), "variation of cornering stiffness with camber";
        phy1: "pHy1" ["-"] -1.0..=1.0, Some(0.0), "horizontal shift of Fy";
        phy2: "pHy2" ["-"] -1.0..=1.0, Some(0.0), "variation of Fy horizontal shift with load";
        phy3: "pHy3" ["-"] -10.0..=10.0, Some(0.0), "variation of Fy horizontal shift with camber";
        pvy1: "pVy1" ["-"] -10.0..=10.0, Some(0.0), "vertical shift of Fy per load";
        pvy2: "pVy2" ["-"] -10.0..=10.0, Some(0.0), "variation of Fy vertical shift with load";
        pvy3: "pVy3" ["-"] -100.0..=100.0, Some(0.0), "variation of Fy vertical shift with camber";
        pvy4: "pVy4" ["-"] -100.0..=100.0, Some(0.0), "variation of Fy vertical shift with camber and load";
        rby1: "rBy1" ["-"] -1000.0..=1000.0, Some(0.0), "slope factor of combined slip Fy";
        rby2: "rBy2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of combined Fy slope with slip angle";
        rby3: "rBy3" ["-"] -10.0..=10.0, Some(0.0), "slip-angle shift of combined Fy slope";
        rcy1: "rCy1" ["-"] -10.0..=10.0, Some(1.0), "shape factor of combined slip Fy";
        rey1: "rEy1" ["-"] -1000.0..=1000.0, Some(0.0), "curvature of combined slip Fy";
        rey2: "rEy2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of combined Fy curvature with load";
        rhy1: "rHy1" ["-"] -1.0..=1.0, Some(0.0), "shift of combined slip Fy";
        rhy2: "rHy2" ["-"] -1.0..=1.0, Some(0.0), "variation of combined Fy shift with load";
        rvy1: "rVy1" ["-"] -100.0..=100.0, Some(0.0), "slip-ratio-induced Fy per friction";
        rvy2: "rVy2" ["-"] -100.0..=100.0, Some(0.0), "variation of slip-ratio-induced Fy with load";
        rvy3: "rVy3" ["-"] -1000.0..=1000.0, Some(0.0), "variation of slip-ratio-induced Fy with camber";
        rvy4: "rVy4" ["-"] -1000.0..=1000.0, Some(0.0), "variation of slip-ratio-induced Fy with slip angle";
        rvy5: "rVy5" ["-"] -100.0..=100.0, Some(0.0), "shape factor of slip-ratio-induced Fy";
        rvy6: "rVy6" ["-"] -1000.0..=1000.0, Some(0.0), "slope factor of slip-ratio-induced Fy";
        qbz1: "qBz1" ["-"] -1000.0..=1000.0, Some(0.0), "slope factor of trail";
        qbz2: "qBz2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of trail slope with load";
        qbz3: "qBz3" ["-"] -1000.0..=1000.0, Some(0.0), "variation of trail slope with load squared";
        qbz4: "qBz4" ["-"] -1000.0..=1000.0, Some(0.0), "variation of trail slope with camber";
        qbz5: "qBz5" ["-"] -1000.0..=1000.0, Some(0.0), "variation of trail slope with camber magnitude";
        qbz9: "qBz9" ["-"] -1000.0..=1000.0, Some(0.0), "slope factor of residual moment";
        qbz10: "qBz10" ["-"] -1000.0..=1000.0, Some(0.0), "slope factor of residual moment from cornering stiffness";
        qcz1: "qCz1" ["-"] -10.0..=10.0, Some(1.0), "shape factor of trail";
        qdz1: "qDz1" ["-"] -10.0..=10.0, Some(0.0), "peak trail per radius";
        qdz2: "qDz2" ["-"] -10.0..=10.0, Some(0.0), "variation of peak trail with load";
        qdz3: "qDz3" ["-"] -1000.0..=1000.0, Some(0.0), "variation of peak trail with camber";
        qdz4: "qDz4" ["-"] -1000.0..=1000.0, Some(0.0), "variation of peak trail with camber squared";
        qdz6: "qDz6" ["-"] -10.0..=10.0, Some(0.0), "peak residual moment";
        qdz7: "qDz7" ["-"] -10.0..=10.0, Some(0.0), "variation of residual moment with load";
        qdz8: "qDz8" ["-"] -100.0..=100.0, Some(0.0), "variation of residual moment with camber";
        qdz9: "qDz9" ["-"] -100.0..=100.0, Some(0.0), "variation of residual moment with camber and load";
        qez1: "qEz1" ["-"] -1000.0..=1000.0, Some(0.0), "curvature of trail";
        qez2: "qEz2" ["-"] -1000.0..=1000.0, Some(0.0), "variation of trail curvature with load";
        qez3: "qEz3" ["-"] -1000.0..=1000.0, Some(0.0), "variation of trail curvature with load squared";
        qez4: "qEz4" ["-"] -1000.0..=1000.0, Some(0.0), "trail curvature, left against right";
        qez5: "qEz5" ["-"] -1000.0..=1000.0, Some(0.0), "variation of trail curvature with camber";
        qhz1: "qHz1" ["-"] -1.0..=1.0, Some(0.0), "horizontal shift of trail";
        qhz2: "qHz2" ["-"] -1.0..=1.0, Some(0.0), "variation of trail shift with load";
        qhz3: "qHz3" ["-"] -10.0..=10.0, Some(0.0), "variation of trail shift with camber";
        qhz4: "qHz4" ["-"] -10.0..=10.0, Some(0.0), "variation of trail shift with camber and load";
        ssz1: "sSz1" ["-"] -10.0..=10.0, Some(0.0), "moment arm of Fx per radius";
        ssz2: "sSz2" ["-"] -10.0..=10.0, Some(0.0), "variation of Fx moment arm with Fy";
        ssz3: "sSz3" ["-"] -100.0..=100.0, Some(0.0), "variation of Fx moment arm with camber";
        ssz4: "sSz4" ["-"] -100.0..=100.0, Some(0.0), "variation of Fx moment arm with camber and load";
        tyre_side: "TYRESIDE" ["-"] -1.0..=1.0, Some(0.0), "side of its measurement: LEFT (1), RIGHT (-1) or UNKNOWN (0)";
    }
}
