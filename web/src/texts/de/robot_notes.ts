// Notes on robots of the catalogue: the catalogue's sentences, and what they say in German.
export const robotNotes: Record<string, string> = {
  'The transforms of Section 3.1 as a table: 2A3 with l2 in the y row, as the position equations of Section 3.2 need it.':
    'Die Transformationen aus Abschnitt 3.1 als Tabelle: 2A3 mit l2 in der y-Zeile, wie es die Positionsgleichungen in Abschnitt 3.2 brauchen.',
  'Position limits: Table 1. Velocity, acceleration and jerk are not published: they are estimates of a light electric arm, which moves through the range of an axis in 2 s (0.25 m/s, 180 degrees/s) and reaches full speed in 0.25 s.':
    'Positionsgrenzen: Tabelle 1. Geschwindigkeit, Beschleunigung und Ruck sind nicht veröffentlicht, sondern Schätzungen für einen leichten elektrischen Arm: Er durchfährt den Bereich einer Achse in 2 s (0,25 m/s, 180 Grad/s) und erreicht die volle Geschwindigkeit in 0,25 s.',
  'No masses and no torque limits are published: the torque is that of the payload.':
    'Massen und Drehmomentgrenzen sind nicht veröffentlicht: Das Drehmoment ist das der Nutzlast.',
  'Limits of position, velocity and torque: the URDF. Acceleration and jerk: the default rule.':
    'Grenzen von Position, Geschwindigkeit und Drehmoment: die URDF. Beschleunigung und Ruck: nach der Vorgabe.',
  'The tip is the flange; the fingers are held closed.': 'Die Spitze ist der Flansch; die Finger sind geschlossen.',
  'Limits of position: the URDF, which keeps the elbow within half a turn. Accelerations are not published: by the default rule, full speed in 0.25 s; jerk: full acceleration in 0.1 s.':
    'Grenzen der Position: die URDF, die den Ellbogen innerhalb einer halben Drehung hält. Beschleunigungen sind nicht veröffentlicht: Nach der Vorgabe gilt volle Geschwindigkeit in 0,25 s; Ruck: volle Beschleunigung in 0,1 s.',
  "Limits of torque: the URDF, whose figures are those of UFACTORY's xarm_ros2.":
    'Grenzen des Drehmoments: die URDF mit den Angaben aus xarm_ros2 von UFACTORY.',
  "Lengths: Franka Robotics, FCI documentation, Denavit-Hartenberg parameters (Craig's convention). Masses, centers of mass and inertias: robots/fr3/inertials.yaml of its franka_description.":
    'Längen: Franka Robotics, FCI-Dokumentation, Denavit-Hartenberg-Parameter (nach Craig). Massen, Schwerpunkte und Trägheiten: robots/fr3/inertials.yaml aus franka_description.',
  'The highest velocity of a joint depends on its position: (|v| + offset)^2 <= rate * distance to the end of its range, and 2.62 to 5.26 rad/s far from there. The machine itself goes on to 2.7437, 1.7837, 2.9007, (-3.0421, -0.1518), 2.8065, (0.5445, 4.5169) and 3.0159 rad, where it may hardly move; the position limits end up to 0.014 rad before.':
    'Die höchste Geschwindigkeit eines Gelenks hängt von seiner Position ab: (|v| + Versatz)^2 <= Rate * Abstand vom Ende des Bereichs, weit davon entfernt 2,62 bis 5,26 rad/s. Die Maschine selbst geht weiter bis 2,7437, 1,7837, 2,9007, (-3,0421, -0,1518), 2,8065, (0,5445, 4,5169) und 3,0159 rad, wo sie sich kaum bewegen darf; die Positionsgrenzen enden bis zu 0,014 rad davor.',
  'Of the rated payload only the mass is checked: no figure for the distance of its centre of gravity and for its inertia was found.':
    'Von der Nennlast wird nur die Masse geprüft: Für den Abstand ihres Schwerpunkts und für ihre Trägheit fand sich keine Angabe.',
  "Axis ranges, speeds, lengths and the rated payload of 16 kg are KUKA's figures. Zero and direction of every axis are the controller's.":
    'Achsbereiche, Geschwindigkeiten, Längen und die Nennlast von 16 kg sind Angaben von KUKA. Nullstellung und Drehsinn jeder Achse sind die der Steuerung.',
  'Acceleration is an estimate: full speed in about 0.4 s (axes 1 to 3) and 0.25 s (axes 4 to 6). Jerk is an estimate: full acceleration in 0.1 s.':
    'Die Beschleunigung ist geschätzt: volle Geschwindigkeit in etwa 0,4 s (Achsen 1 bis 3) und 0,25 s (Achsen 4 bis 6). Der Ruck ist geschätzt: volle Beschleunigung in 0,1 s.',
  'Joint origins, ranges and speeds agree with the description of the machine by ROS-Industrial (kuka_experimental).':
    'Gelenkursprünge, Bereiche und Geschwindigkeiten stimmen mit der Beschreibung der Maschine von ROS-Industrial (kuka_experimental) überein.',
  'Masses are estimates: the 235 kg of the machine spread over base and links, each link a solid box or cylinder.':
    'Die Massen sind geschätzt: die 235 kg der Maschine, verteilt auf Sockel und Glieder, jedes Glied ein voller Quader oder Zylinder.',
  'Torque limits are estimates: 1.5 times the largest joint torque in 20,000 random states within the limits of position and speed, every axis at full acceleration, with the rated payload 0.15 m in front of the flange and 0.12 m off its axis, rounded up to two digits.':
    'Die Drehmomentgrenzen sind geschätzt: das 1,5-Fache des größten Gelenkdrehmoments in 20.000 zufälligen Zuständen innerhalb der Grenzen von Position und Geschwindigkeit, jede Achse mit voller Beschleunigung, die Nennlast 0,15 m vor dem Flansch und 0,12 m neben seiner Achse, auf zwei Stellen aufgerundet.',
  "Axis ranges, speeds, lengths and the rated payload of 6 kg are KUKA's figures. Zero and direction of every axis are the controller's.":
    'Achsbereiche, Geschwindigkeiten, Längen und die Nennlast von 6 kg sind Angaben von KUKA. Nullstellung und Drehsinn jeder Achse sind die der Steuerung.',
  'They were not compared with the datasheet itself. The lengths agree with its reach of 1911 mm.':
    'Sie wurden nicht mit dem Datenblatt selbst verglichen. Die Längen stimmen mit seiner Reichweite von 1911 mm überein.',
  'Torque limits are estimates: 1.5 times the largest joint torque in 20,000 random states within the limits of position and speed, every axis at full acceleration, with the rated payload 0.12 m in front of the flange and 0.1 m off its axis, rounded up to two digits.':
    'Die Drehmomentgrenzen sind geschätzt: das 1,5-Fache des größten Gelenkdrehmoments in 20.000 zufälligen Zuständen innerhalb der Grenzen von Position und Geschwindigkeit, jede Achse mit voller Beschleunigung, die Nennlast 0,12 m vor dem Flansch und 0,1 m neben seiner Achse, auf zwei Stellen aufgerundet.',
  'Table 3.1 of document 000 with d3 = 0.7 m moved to d4: as printed the tool point does not depend on joints 3 to 6, and no published pose can be reached.':
    'Tabelle 3.1 des Dokuments 000, mit d3 = 0,7 m nach d4 verschoben: Wie gedruckt hängt der Werkzeugpunkt nicht von den Gelenken 3 bis 6 ab, und keine veröffentlichte Pose ist erreichbar.',
  "Velocity: KUKA's figures for the KR 16 L6-2, not compared with the datasheet itself. Acceleration is an estimate: full speed in about 0.4 s (axes 1 to 3) and 0.25 s (axes 4 to 6). Jerk is an estimate: full acceleration in 0.1 s.":
    'Geschwindigkeit: Angaben von KUKA für den KR 16 L6-2, nicht mit dem Datenblatt selbst verglichen. Die Beschleunigung ist geschätzt: volle Geschwindigkeit in etwa 0,4 s (Achsen 1 bis 3) und 0,25 s (Achsen 4 bis 6). Der Ruck ist geschätzt: volle Beschleunigung in 0,1 s.',
  'The document publishes no position limits, no torque limits and no masses.':
    'Das Dokument veröffentlicht keine Positionsgrenzen, keine Drehmomentgrenzen und keine Massen.',
  'Lengths: Table 3.1 and Section 3.5 of document 000.': 'Längen: Tabelle 3.1 und Abschnitt 3.5 des Dokuments 000.',
  'As printed: the Jacobian has rank 5, so that poses are almost never reachable. Use ngv_refuelling_arm to plan poses.':
    'Wie gedruckt: Die Jacobi-Matrix hat den Rang 5, Posen sind daher fast nie erreichbar. Posen plant man mit ngv_refuelling_arm.',
  'Lengths 100 mm and 170 mm: Table 1.1 and Section 1. The flange is the tool point, 170 mm along x of frame 3.':
    'Längen 100 mm und 170 mm: Tabelle 1.1 und Abschnitt 1. Der Flansch ist der Werkzeugpunkt, 170 mm entlang x des Koordinatensystems 3.',
  'The arm hangs from its foot: the z axis of its base points downwards, and gravity goes along it. A point below the foot has a positive z; in Table 2.2 the elbow that is called up lies at negative z.':
    'Der Arm hängt an seinem Fuß: Die z-Achse seiner Basis zeigt nach unten, mit der Schwerkraft. Ein Punkt unter dem Fuß hat ein positives z; in Tabelle 2.2 liegt der Ellbogen, der dort oben heißt, bei negativem z.',
  'Joint ranges cannot be derived: the arm was moved to angles of -42 to 135 (joint 1), 30 to 148 (joint 2) and 30 to 146 degrees (joint 3), and of the four solutions of a point it can take only case 1 (Section 2), that with shoulder right and elbow up, for reasons that are not given. So no joint has position limits here; ask for that configuration where the real arm is meant.':
    'Gelenkbereiche lassen sich nicht herleiten: Der Arm wurde auf Winkel von -42 bis 135 (Gelenk 1), 30 bis 148 (Gelenk 2) und 30 bis 146 Grad (Gelenk 3) bewegt, und von den vier Lösungen eines Punktes kann er nur Fall 1 einnehmen (Abschnitt 2), mit Schulter rechts und Ellbogen oben, ohne dass Gründe genannt sind. Daher hat hier kein Gelenk Positionsgrenzen; wo der echte Arm gemeint ist, ist diese Konfiguration zu verlangen.',
  'No limits and no masses are published. Velocity is an estimate: half of what a hobby servo does without a load (about 60 degrees in 0.17 s). Acceleration is an estimate: full speed in 0.15 s; jerk: full acceleration in 0.1 s.':
    'Grenzen und Massen sind nicht veröffentlicht. Die Geschwindigkeit ist geschätzt: halb so hoch wie die eines Modellbauservos ohne Last (etwa 60 Grad in 0,17 s). Die Beschleunigung ist geschätzt: volle Geschwindigkeit in 0,15 s; der Ruck: volle Beschleunigung in 0,1 s.',
  'Lengths, masses and centers of mass: Universal Robots, article DH parameters for calculations of kinematics and dynamics. Inertias are those of its ROS description. The base frame is that of the table and of the controller.':
    'Längen, Massen und Schwerpunkte: Universal Robots, Artikel „DH parameters for calculations of kinematics and dynamics“. Die Trägheiten sind die seiner ROS-Beschreibung. Das Basiskoordinatensystem ist das der Tabelle und der Steuerung.',
  'Accelerations are not published: by the default rule, full speed in 0.25 s; jerk: full acceleration in 0.1 s.':
    'Beschleunigungen sind nicht veröffentlicht: Nach der Vorgabe gilt volle Geschwindigkeit in 0,25 s; Ruck: volle Beschleunigung in 0,1 s.',
  'Of the rated payload only the mass is checked: the user manual shows the distance of its centre of gravity as a diagram without numbers, and limits no inertia (the controller accelerates less).':
    'Von der Nennlast wird nur die Masse geprüft: Das Handbuch zeigt den Abstand ihres Schwerpunkts als Diagramm ohne Zahlen und begrenzt keine Trägheit (die Steuerung beschleunigt dann weniger).',
  'Lengths, masses and centers of mass: Universal Robots, article DH parameters for calculations of kinematics and dynamics. Inertias are those that its ROS description computes from cylinders. The base frame is that of the table and of the controller.':
    'Längen, Massen und Schwerpunkte: Universal Robots, Artikel „DH parameters for calculations of kinematics and dynamics“. Die Trägheiten berechnet seine ROS-Beschreibung aus Zylindern. Das Basiskoordinatensystem ist das der Tabelle und der Steuerung.',
  'Wrist 3 turns for ever.': 'Handgelenk 3 dreht endlos.',
  'Document 001 publishes the structure of the table but no lengths: they are those of document 000, which uses the same one. The base height is that of the KR 16; without it the first welding point is out of reach.':
    'Dokument 001 veröffentlicht den Aufbau der Tabelle, aber keine Längen: Es sind die des Dokuments 000, das denselben hat. Die Sockelhöhe ist die des KR 16; ohne sie ist der erste Schweißpunkt unerreichbar.',
  "Velocity: KUKA's figures for the KR 16-2. Acceleration is an estimate: full speed in about 0.4 s (axes 1 to 3) and 0.25 s (axes 4 to 6). Jerk is an estimate: full acceleration in 0.1 s.":
    'Geschwindigkeit: Angaben von KUKA für den KR 16-2. Die Beschleunigung ist geschätzt: volle Geschwindigkeit in etwa 0,4 s (Achsen 1 bis 3) und 0,25 s (Achsen 4 bis 6). Der Ruck ist geschätzt: volle Beschleunigung in 0,1 s.',
  'The document publishes no position limits, no torque limits and no link masses.':
    'Das Dokument veröffentlicht keine Positionsgrenzen, keine Drehmomentgrenzen und keine Massen der Glieder.',
};
