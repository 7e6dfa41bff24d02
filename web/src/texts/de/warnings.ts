// What the warnings of plans mean, by their codes.
export const warnings: Record<string, string> = {
  waypoint_repeated:
    'Ein Wegpunkt hat dieselbe Gelenkstellung wie der vor ihm: Der Roboter passiert beide zugleich oder ruht die verlangte Zeit.',
  position_snapped: 'Eine Gelenkstellung liegt um weniger als die Toleranz jenseits ihrer Grenze; der Plan nimmt die Grenze.',
  tool_deviates: 'Das Werkzeug entfernt sich weit von der geraden Gelenkbewegung; max_deviation begrenzt das.',
  joint_deviates: 'Ein Gelenk entfernt sich weit von der geraden Gelenkbewegung; max_joint_deviation begrenzt das.',
  position_unchecked: 'Nicht alle Gelenke haben Positionsgrenzen: Dort wird keine Position abgelehnt.',
  attached_far_from_tool: 'Ein Objekt am Werkzeug ist weit davon entfernt; seine Pose gilt im Koordinatensystem des Werkzeugs.',
  following_error_not_covered: 'Einige Grenzen gelten für geplante Positionen, nicht für alle innerhalb der Folgefehler.',
  tolerances_not_covered: 'Einige Grenzen gelten für die angegebene Nutzlast und Reibung, nicht für alle innerhalb der Toleranzen.',
  torque_unchecked: 'Drehmomente sind nicht geprüft: Dem Roboter fehlen ihre Grenzen oder die Massen.',
  payload_only: 'Der Roboter hat keine Massen: Drehmomente sind die der Nutzlast allein.',
  nothing_to_optimise: 'Nichts an der Anfrage ist offen; die Dauer bleibt, wie sie ist.',
  ride_search_ended: 'Die Zeit für die Suche war zu kurz; eine frühere Ankunft und ein späterer Start sind möglich.',
  waits_for_object: 'Der Roboter wartet an einem Wegpunkt länger, bis ein bewegtes Objekt vorbei ist.',
  suboptimal: 'Die Suche hat ihr Optimum nicht erreicht; die Bewegung hält alle Grenzen ein.',
  blend_reduced: 'Ein Überschleifradius ist kleiner als verlangt, weil sonst etwas zu nah käme.',
  estimated_shapes: 'Die Maschine kann aus ihren geschätzten Formen ragen; mit mehr Abstand planen.',
  orientation_deviates: 'Das Werkzeug weicht an einer Singularität des Handgelenks von seiner Orientierung ab.',
  near_singularity: 'Eine Bewegung führt nah an einer Singularität vorbei; das Werkzeug muss dort langsam sein.',
  stops_at_the_end: 'Kein schnellerer Halt wurde gefunden als der am Ende der Bahn.',
  payload_above_rating: 'Die Nutzlast ist schwerer, als der Hersteller erlaubt.',
  starts_in_motion: 'Die Trajektorie beginnt in Bewegung.',
  ends_in_motion: 'Die Trajektorie endet in Bewegung.',
  effort_incomplete: 'Einige Glieder haben keine Massen: Aufwand und Ruck werden zusammen klein gehalten.',
  solver_failed:
    'Der Löser von toppra ist auf dieser Bahn gescheitert; die Bewegung hält auch die Ruckgrenzen ein und ist deshalb langsamer.',
  velocity_not_enforced:
    'Geschwindigkeit: Dieses Verfahren berichtet nur, ob die Grenze der Anfrage eingehalten ist, und erzwingt sie nicht.',
  acceleration_not_enforced:
    'Beschleunigung: Dieses Verfahren berichtet nur, ob die Grenze der Anfrage eingehalten ist, und erzwingt sie nicht.',
  jerk_not_enforced: 'Ruck: Dieses Verfahren berichtet nur, ob die Grenze der Anfrage eingehalten ist, und erzwingt sie nicht.',
  torque_not_enforced: 'Drehmoment: Dieses Verfahren berichtet nur, ob die Grenze der Anfrage eingehalten ist, und erzwingt sie nicht.',
  auto_choice: 'Das Verfahren ist selbst gewählt.',
  samples_overshoot: 'Zwischen den Abtastwerten könnte eine Steuerung Grenzen überschreiten: eine kürzere Abtastzeit verlangen.',
};
